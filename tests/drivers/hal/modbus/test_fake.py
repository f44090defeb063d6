"""Two real door drivers on one real bus, with a simulated Modbus gateway or serial line.

The tests read the doors while the simulation fails, and again after the failure.
"""

import asyncio
import gc
import socket
import struct
from collections.abc import Iterator

import msgspec
import pytest

from bridges.kinds.door.signals import DoorOutputs, DoorSample
from drivers import DriverError
from drivers.door.dry_contact import DryContactDoor, DryContactDoorSettings, create, wires
from drivers.hal import modbus
from drivers.hal.points import HalError
from hal_fakes.modbus import ModbusServer
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.plants.door import DoorPlant
from hal_fakes.plants.plant import FAILURE_MODES, FailureMode
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.hal.modbus.module import Time
from tests.waiting import at_last, wait_until

TIMEOUT_S = 0.2
CLOSED = DoorSample(opened=False, closed=True)
OPEN = DoorSample(opened=True, closed=False)
HOLD, RELEASE = DoorOutputs(hold_open=True), DoorOutputs(hold_open=False)


def door_at(unit: int) -> DryContactDoorSettings:
    """Return the settings of a door at this unit."""
    return msgspec.convert(
        {
            "inputs": {
                "opened": {"point": f"unit {unit} discrete input 0", "active": "high"},
                "closed": {"point": f"unit {unit} discrete input 4", "active": "high"},
            },
            "outputs": {"hold_open": {"point": f"unit {unit} coil 16", "active": "high"}},
        },
        DryContactDoorSettings,
    )


class Site:
    """Two doors on one bus: units 1 and 2 of one gateway or serial line. The bus measures its pauses
    with `clock`."""

    def __init__(self, serial: modbus.Serial | None) -> None:
        self.settings = {"front": door_at(1), "ward": door_at(2)}
        self.world = RealTime(
            {
                name: DoorPlant(name, wires(s), open_s=0.05, close_s=0.05, auto_close_s=0.05)
                for name, s in self.settings.items()
            }
        )
        self.plants = self.world.plants
        wired = [
            PlantWiring(self.plants[name], wires(s), modbus.canonical)
            for name, s in self.settings.items()
        ]
        self.server = (
            RtuLine(wired, serial, slow_s=2.2 * TIMEOUT_S)
            if serial
            else ModbusServer(wired, slow_s=1.5 * TIMEOUT_S)
        )
        plain = {"type": "modbus", "timeout_s": TIMEOUT_S, **self.server.replace}
        self.clock = Time()
        self.bus = modbus.ModbusBus(msgspec.convert(plain, modbus.ModbusSettings), self.clock)
        self.doors: dict[str, DryContactDoor] = {
            name: create(name, s, self.bus) for name, s in self.settings.items()
        }

    def patiently(self, name: str) -> DoorSample | str:
        """Let the bus's pauses end, and read once. Return the sample or the error's text."""
        self.clock.now += 60.0
        try:
            return self.doors[name].read()
        except DriverError as error:
            return str(error)

    def reads(self, name: str) -> DoorSample:
        """Read again and again, as the daemon's scans do, until a reading succeeds. Return that
        reading."""
        return at_last(self.doors[name].read, "the door is read", self.a_moment)

    def write(self, name: str, outputs: DoorOutputs) -> None:
        """Write these outputs again and again until a write succeeds."""
        at_last(lambda: self.doors[name].write(outputs), "the outputs are written", self.a_moment)

    def a_moment(self) -> None:
        """Let 1 s pass. The bus pauses for longer than 1 s after a silent unit."""
        self.clock.now += 1.0

    def close(self) -> None:
        for door in self.doors.values():
            door.close()
        self.bus.close()
        self.server.close()
        self.server.close()
        self.world.close()


SERIAL = {
    "tcp": None,
    "rtu": modbus.Serial(port="/dev/null", baudrate=57600, parity="even", stopbits=1),
    "rtu with echo": modbus.Serial(
        port="/dev/null", baudrate=57600, parity="none", stopbits=2, ignore_echo=True
    ),
}


@pytest.fixture(params=SERIAL)
def site(request: pytest.FixtureRequest) -> Iterator[Site]:
    built = Site(SERIAL[request.param])
    for door in built.doors.values():  # without a first answer the bus would not retry
        at_last(door.open, "the driver opens", built.a_moment)
    yield built
    built.close()


def test_an_unknown_address_is_refused_and_an_unknown_unit_by_a_gateway_only(site: Site) -> None:
    def refusal(point: str) -> str:
        with pytest.raises(HalError) as caught:
            site.bus.lines({point: None}, {}).read()
        return str(caught.value).partition(": exception ")[2][:2]

    assert refusal("unit 1 discrete input 9") == "2,"
    assert refusal("unit 9 discrete input 0") == ("11" if "tcp" in site.server.replace else "")


FAILING = [
    (part, mode)
    for part in ("server", "unit")
    for mode in FAILURE_MODES
    if (part, mode) != ("unit", "stuck")
]

REASONS = {
    ("server", "off"): ("no Modbus TCP connection to", "no serial port"),
    ("server", "stuck"): ("no reply within",),
    ("server", "slow"): ("no reply within",),
    ("server", "garbage"): ("no ",),
    ("server", "wrong"): ("no reply within",),
    ("unit", "off"): ("no reply within",),
    ("unit", "slow"): ("no reply within",),
    ("unit", "garbage"): ("no ",),
    ("unit", "wrong"): ("exception 4, server device failure", "no reply within"),
}


@pytest.mark.parametrize(("part", "mode"), FAILING)
def test_each_failure_is_a_hal_error_and_the_door_is_back_afterwards(
    site: Site, part: str, mode: FailureMode
) -> None:
    site.plants["front"].fail(part, mode)
    found: list[str] = []

    def failing() -> bool:
        found.append(str(site.patiently("front")))
        return any(reason in found[-1] for reason in REASONS[part, mode])

    wait_until(failing, f"the failure {part} {mode} is reported")
    site.plants["front"].fail(part, None)
    wait_until(lambda: site.patiently("front") == CLOSED, "the front door reads closed again")
    assert site.patiently("ward") == CLOSED


WAYS: dict[str, dict[FailureMode, tuple[str, ...]]] = {
    "tcp": {"wrong": ("no reply within",), "garbage": ("no reply within",)},
    "rtu": {
        "wrong": ("of another unit", "exception 4", "if the adapter echoes"),
        "garbage": ("half a frame", "CRC of "),
    },
}
"""The possible error texts when the whole gateway or serial line fails in this mode."""


@pytest.mark.parametrize("mode", ["wrong", "garbage"])
@pytest.mark.parametrize("framing", WAYS)
def test_a_far_side_fails_in_several_ways_and_each_is_named(
    framing: str, mode: FailureMode
) -> None:
    site = Site(SERIAL[framing])
    try:
        site.plants["front"].fail("server", mode)
        found: list[str] = []

        def all_seen() -> bool:
            found.append(str(site.patiently("front")))
            return all(any(way in text for text in found) for way in WAYS[framing][mode])

        wait_until(all_seen, mode)
        assert str(CLOSED) not in found
    finally:
        site.close()


@pytest.mark.parametrize("mode", ["off", "slow", "garbage", "wrong"])
def test_a_failing_unit_does_not_keep_the_other_from_being_read(
    site: Site, mode: FailureMode
) -> None:
    site.plants["front"].fail("unit", mode)
    front = [_sample_or_none(site.doors["front"]) for _ in range(20)]
    ward = [at_last(site.doors["ward"].read, "ward", site.a_moment) for _ in range(20)]
    assert (front, ward) == ([None] * 20, [CLOSED] * 20)


def test_the_inputs_of_a_stuck_unit_stay_as_they_were(site: Site) -> None:
    front, plant = site.doors["front"], site.plants["front"]
    at_last(front.read, "the front door is read", site.a_moment)
    plant.fail("unit", "stuck")
    site.write("front", HOLD)
    wait_until(lambda: plant.sense("opened"), "the door is open")
    assert at_last(front.read, "the stuck unit is read", site.a_moment) == CLOSED
    plant.fail("unit", None)
    assert at_last(front.read, "the mended unit is read", site.a_moment) == OPEN


def _sample_or_none(door: DryContactDoor) -> DoorSample | None:
    try:
        return door.read()
    except DriverError:
        return None


def test_a_server_that_still_owes_an_answer_ends_without_a_log_line(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """asyncio would log the unfinished task later, in the middle of another test."""
    _end_with_a_slow_answer()
    gc.collect()
    assert caplog.messages == []


def _end_with_a_slow_answer() -> None:
    settings = door_at(1)
    world = RealTime({"front": DoorPlant("front", wires(settings))})
    plant = world.plants["front"]
    server = ModbusServer([PlantWiring(plant, wires(settings), modbus.canonical)], slow_s=3600.0)
    plant.fail("server", "slow")
    with socket.create_connection(("127.0.0.1", server._port)) as caller:
        caller.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 1, 2, 0, 1))
        wait_until(lambda: len(asyncio.all_tasks(server._loop)) == 2, "the request has come")
        server.close()
    world.close()
