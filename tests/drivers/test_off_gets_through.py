"""Buses on which a read fails, once or for ever. The driver must still be able to switch its outputs
off.

In each test one output is on. The failing read concerns another part of the same device, or another
device on the bus.
"""

import struct
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import gpiozero
import msgspec
import pytest
from gpiozero.pins.mock import MockFactory

from bridges.kinds.charger.signals import ChargerOutputs
from bridges.kinds.door.signals import DoorOutputs
from drivers import DriverError
from drivers.charger import http as charger_http
from drivers.charger import modbus
from drivers.door import dry_contact, register
from drivers.hal import http
from drivers.hal.gpio import GpioBus
from drivers.hal.points import Points, Wire
from tests.drivers.charger.test_canopen import DISABLE, Receiver
from tests.drivers.hal.modbus.conftest import hang_up, module
from tests.drivers.hal.modbus.module import Module, Time, bus_to, frame

__all__ = ["hang_up", "module"]

HELD, RELEASED = DoorOutputs(hold_open=True), DoorOutputs(hold_open=False)
STATUS, COMMAND = (3, 10), (3, 20)
"""Two holding registers of a door, as (function code for reading the register, address)."""
SERVER_FAILURE, ILLEGAL_ADDRESS = 4, 2


class Registers:
    """A Modbus module whose units have registers and coils. The test can let reads fail.

    `refused` has the exception code for each (unit, reading function, address). For code 0 the module
    sends no answer.
    """

    def __init__(self, module: Module) -> None:
        self.words: dict[tuple[int, int, int], int] = {}
        self.refused: dict[tuple[int, int, int], int] = {}
        self.written: list[tuple[int, int]] = []
        module.reply = self.answer

    def answer(self, request: bytes) -> bytes:
        """Answer functions 1 to 6 according to the Modbus specification."""
        unit, function, address, value = struct.unpack(">BBHH", request[6:12])
        reads = {5: 1, 6: 3}.get(function, function)
        count = value if function < 5 else 1
        cells = [(unit, reads, address + i) for i in range(count)]
        if function < 5:
            for cell in cells:
                if cell in self.refused:
                    code = self.refused[cell]
                    return frame(request, bytes((function | 0x80, code))) if code else b""
            found = [self.words.get(cell, 0) for cell in cells]
            packed = sum(bool(bit) << i for i, bit in enumerate(found))
            body = (
                packed.to_bytes((count + 7) // 8, "little")
                if function < 3
                else struct.pack(f">{count}H", *found)
            )
            return frame(request, bytes((function, len(body))) + body)
        if (unit, function, address) in self.refused:
            return b""
        self.words[cells[0]] = {0xFF00: 1}.get(value, value) if function == 5 else value
        self.written.append((address, value))
        return frame(request, request[7:12])


@pytest.fixture
def registers(module: Module) -> Registers:
    return Registers(module)


REGISTER_DOOR = msgspec.convert(
    {
        "unit": 1,
        "map": {
            "status": {"at": "holding register 10", "open": [2], "closed": [0], "moving": [1]},
            "command": {"at": "holding register 20", "hold": 7, "release": 5},
        },
    },
    register.RegisterDoorSettings,
)
CONTACT_DOOR = msgspec.convert(
    {
        "inputs": {
            "opened": {"point": "unit 1 discrete input 0", "active": "high"},
            "closed": {"point": "unit 1 discrete input 1", "active": "high"},
        },
        "outputs": {"hold_open": {"point": "unit 1 coil 0", "active": "high"}},
    },
    dry_contact.DryContactDoorSettings,
)


def tried(step: Callable[[], object]) -> bool:
    """Return whether the step succeeds without a DriverError."""
    try:
        step()
    except DriverError:
        return False
    return True


@pytest.mark.parametrize("code", [ILLEGAL_ADDRESS, SERVER_FAILURE, 0])
def test_a_start_releases_a_door_whose_status_cannot_be_read(
    module: Module, registers: Registers, code: int
) -> None:
    registers.words[1, *COMMAND] = 7
    registers.refused[1, *STATUS] = code
    bus = bus_to(module.port, timeout_s=1.0)
    door = register.create("front", REGISTER_DOOR, bus)
    tried(door.open)
    assert registers.words[1, *COMMAND] == 5
    assert not tried(door.read)


@pytest.mark.parametrize("code", [ILLEGAL_ADDRESS, SERVER_FAILURE, 0])
def test_a_start_releases_a_door_that_can_only_be_written(
    module: Module, registers: Registers, code: int
) -> None:
    registers.refused[1, *STATUS] = code
    door_map = REGISTER_DOOR.map
    assert door_map
    mute = msgspec.structs.replace(
        REGISTER_DOOR,
        map=msgspec.structs.replace(
            door_map, command=msgspec.structs.replace(door_map.command, read_back=False)
        ),
    )
    tried(register.create("front", mute, bus_to(module.port, timeout_s=1.0)).open)
    assert registers.written == [(20, 5)]


@pytest.mark.parametrize("code", [SERVER_FAILURE, 0])
def test_a_held_door_whose_status_fails_is_released_at_once_and_not_after_the_units_pause(
    module: Module, registers: Registers, code: int
) -> None:
    bus = bus_to(module.port, timeout_s=1.0)
    door = register.create("front", REGISTER_DOOR, bus)
    door.open()
    door.read()
    door.write(HELD)
    registers.refused[1, *STATUS] = code
    assert not tried(door.read)
    door.write(RELEASED)
    assert registers.words[1, *COMMAND] == 5


@pytest.mark.parametrize("code", [SERVER_FAILURE, 0])
def test_a_relay_goes_off_while_the_inputs_of_its_unit_fail_for_ever(
    module: Module, registers: Registers, code: int
) -> None:
    clock = Time()
    door = dry_contact.create("front", CONTACT_DOOR, bus_to(module.port, clock, timeout_s=0.3))
    door.open()
    door.read()
    door.write(HELD)
    registers.refused[1, 2, 0] = code
    for _ in range(20):  # 20 failures make the bus's pause long, but `write` must not wait
        clock.now += 30.0
        assert not tried(door.read)
    door.write(RELEASED)
    assert registers.words[1, 1, 0] == 0


def test_an_off_that_is_lost_is_tried_again_while_readings_fail(
    module: Module, registers: Registers
) -> None:
    clock = Time()
    door = dry_contact.create("front", CONTACT_DOOR, bus_to(module.port, clock, timeout_s=1.0))
    door.open()
    door.read()
    door.write(HELD)
    registers.refused |= {(1, 2, 0): SERVER_FAILURE, (1, 5, 0): 0}
    assert not tried(door.read)
    assert not tried(lambda: door.write(RELEASED))
    del registers.refused[1, 5, 0]
    clock.now += 0.5
    assert not tried(door.read)
    door.write(RELEASED)
    assert registers.words[1, 1, 0] == 0


def two_relays() -> list[Wire]:
    return [Wire(f"relay_{u}", "out", f"unit {u} coil 0", "high") for u in (1, 2)]


@pytest.mark.parametrize("dead", [1, 2])
def test_a_dead_unit_keeps_no_other_units_relay_on(
    module: Module, registers: Registers, dead: int
) -> None:
    points = Points(two_relays(), bus_to(module.port, timeout_s=1.0))
    points.open()
    points.write({"relay_1": True, "relay_2": True})
    registers.refused |= {(dead, 1, 0): 0, (dead, 5, 0): 0}
    assert not tried(points.make_safe)
    assert registers.words[3 - dead, 1, 0] == 0


@pytest.mark.parametrize("dead", [1, 2])
def test_a_start_switches_off_what_it_can_while_one_unit_is_dead(
    module: Module, registers: Registers, dead: int
) -> None:
    registers.words |= {(1, 1, 0): 1, (2, 1, 0): 1}
    registers.refused |= {(dead, 1, 0): 0, (dead, 5, 0): 0}
    points = Points(two_relays(), bus_to(module.port, timeout_s=1.0))
    assert not tried(points.open)
    assert (registers.words[1, 1, 0], registers.words[2, 1, 0]).index(0) == 2 - dead


def test_a_start_releases_though_the_modules_watchdog_cannot_be_armed(
    module: Module, registers: Registers
) -> None:
    registers.words[1, 1, 0] = 1
    registers.refused[1, 3, 99] = ILLEGAL_ADDRESS
    bus = bus_to(
        module.port,
        module_watchdog={
            "units": [1],
            "habits": {
                "time_s": 2.0,
                "arm": [{"at": "holding register 98", "value": 1}],
                "armed": [{"at": "holding register 99", "values": [1]}],
                "refresh": {"at": "holding register 98", "values": [1, 2]},
                "refresh_s": 1.0,
            },
        },
    )
    assert not tried(dry_contact.create("front", CONTACT_DOOR, bus).open)
    assert registers.words[1, 1, 0] == 0


@pytest.mark.parametrize("code", [SERVER_FAILURE, 0])
def test_a_charge_on_modbus_is_stopped_while_its_state_cannot_be_read(
    module: Module, registers: Registers, code: int
) -> None:
    settings = modbus.ModbusChargerSettings(unit=1)
    charger = modbus.create("c", settings, bus_to(module.port, timeout_s=1.0))
    charger.read()
    charger.write(ChargerOutputs(power=True))
    assert registers.words[1, 1, 0] == 1
    registers.refused[1, 4, 51] = code
    assert not tried(charger.read)
    tried(lambda: charger.write(ChargerOutputs(power=False)))
    assert registers.words[1, 1, 0] == 0


def test_a_charge_on_canopen_is_stopped_while_its_state_is_not_answered() -> None:
    receiver = Receiver()
    receiver.bus.take()
    receiver.scan(ChargerOutputs(power=True))
    receiver.silent = {(0x2002, 0x0A)}
    receiver.beat()
    assert not tried(receiver.driver.read)
    tried(lambda: receiver.driver.write(ChargerOutputs(power=False)))
    receiver.bus.close()
    assert receiver.writes[-1] == DISABLE


class HttpStation:
    """An HTTP server of a device. It accepts every command, and the test controls its answers to
    /state."""

    def __init__(self) -> None:
        station = self
        self.status = 200
        self.taken: list[str] = []

        class Call(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.said(station.status, b'{"state": 2}')

            def do_POST(self) -> None:
                station.taken.append(self.path)
                self.said(200, b"{}")

            def said(self, status: int, body: bytes) -> None:
                self.send_response(status)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *args: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Call)
        self.thread = Thread(target=self.server.serve_forever, args=(0.02,))
        self.thread.start()

    def close(self) -> None:
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()


def test_a_charge_on_http_is_stopped_while_its_state_cannot_be_read() -> None:
    station = HttpStation()
    settings = msgspec.convert(
        {"codes": {"idle": [0], "charging": [2]}, "stop": {"path": "/stop"}},
        charger_http.HttpChargerSettings,
    )
    api = f"127.0.0.1:{station.server.server_address[1]}"
    bus = http.HttpBus(http.HttpSettings(api_base=api, timeout_s=5.0), clock=Time())
    charger = charger_http.create("c", settings, bus)
    try:
        charger.read()
        station.status = 500
        assert not tried(charger.read)
        charger.write(ChargerOutputs(power=False))
    finally:
        bus.close()
        station.close()
    assert station.taken == ["/stop"]


def test_a_pin_that_cannot_be_written_keeps_no_other_pin_on() -> None:
    factory = MockFactory()
    for number in (17, 18):
        pin = factory.pin(number)
        pin.output_with_state = _claimed(pin)
    bus = GpioBus(factory, Time())
    lines = bus.lines({}, {"BCM17": False, "BCM18": False})
    lines.claim()
    lines.write({"BCM17": True, "BCM18": True})
    broken = factory.pin(17)
    broken.function = "input"  # from here on gpiozero refuses to drive the pin
    assert not tried(lambda: lines.write({"BCM17": False, "BCM18": False}))
    assert factory.pin(18).state == 0
    bus.close()


def _claimed(pin: gpiozero.Pin) -> Callable[[bool], None]:
    def claim(state: bool) -> None:
        pin.function = "output"
        pin.state = state

    return claim
