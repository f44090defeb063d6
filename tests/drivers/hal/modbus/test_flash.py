"""Pulses whose length the Modbus module measures. Each pulse needs exactly one frame from the bus.

The tests compare every byte of these frames.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.kinds.door.core import decide, initial
from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.signals import CloseRequested, DoorOutputs, Event, OpenRequested
from bridges.kinds.shared.decision import Sampled, WriteFailed
from bridges.settings.load import load
from bridges.settings.sheets.findings import findings
from bridges.settings.sheets.text import lines
from drivers import DriverError
from drivers.door.dry_contact import DryContactDoor, DryContactDoorSettings, create, debounce, wires
from drivers.hal import gpio, modbus
from drivers.hal.points import Flash, HalError, Wire
from hal_fakes.plants.door import DoorPlant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.benches import RS485, on_modbus
from tests.drivers.hal.modbus.line import SerialModule, rtu
from tests.drivers.hal.modbus.module import Module, Time, bus_to, door, frame
from tests.settings.reading import problems_of
from tests.waiting import wait_until

SHIPPED = Path(__file__).parents[4] / "config" / "door_waveshare.yaml"
COIL = "unit 1 coil 0"
FLASH = Flash("unit 1 coil 0x200", 0.7)
FLASH_PDU = "0502000007"
PULSE, BETWEEN, RELEASE = DoorOutputs(True), DoorOutputs(between_pulses=True), DoorOutputs()
SCAN_S = 0.125


def pulsed(on_s: float = 0.7, every_s: float = 3.0) -> DryContactDoorSettings:
    """Return the settings of a door whose operator needs pulses. The pulses come from relay 0 of unit
    1."""
    plain = {
        "inputs": {
            "opened": {"point": "unit 1 discrete input 0", "active": "high"},
            "closed": {"point": "unit 1 discrete input 1", "active": "high"},
        },
        "outputs": {"hold_open": {"point": COIL, "active": "high", "flash": FLASH.point}},
        "pulse": {"on_s": on_s, "every_s": every_s},
    }
    return msgspec.convert(plain, DryContactDoorSettings)


def claimed(module: Module, **settings: Any) -> DryContactDoor:
    """Return an open driver that has read and written once. Then empty `asked`, the module's
    requests."""
    door(module)
    driver = create("door", pulsed(), bus_to(module.port, **settings))
    driver.open()
    driver.read()
    driver.write(RELEASE)
    module.asked.clear()
    return driver


def writes(module: Module) -> list[str]:
    """Return the PDU of each write that the module has received."""
    return [request[7:].hex() for request in module.asked if request[7] == 5]


def loses_replies(module: Module) -> None:
    """Let the module obey writes without answering them."""
    module.reply = lambda request: b"" if request[7] == 5 else module.answer(request)


def answers(driver: DryContactDoor, clock: Time) -> bool:
    """Let the bus's pauses end. Return whether the driver can then read the door."""
    clock.now += 60.0
    try:
        driver.read()
    except DriverError:
        return False
    return True


def held(module: Module, *, lost_at: float | None = None) -> list[tuple[float, str]]:
    """Let RMF (Open-RMF) open a door at 1 s and close it at 6 s. Return (s, PDU) of each write.

    Each scan runs the driver and the core, as in the daemon's loop. If `lost_at` is a time, the module
    answers no write in the scan at that time.
    """
    clock, settings = Time(), pulsed()
    driver = claimed(module, clock=clock, timeout_s=1.0)
    limits = DoorLimits.of(settings, debounce(settings))
    memory, told = initial(limits, 0.0), list[tuple[float, str]]()
    said: dict[float, Event] = {
        1.0: OpenRequested("a"),
        3.0: OpenRequested("b"),
        6.0: CloseRequested("a"),
    }
    for now in (scan * SCAN_S for scan in range(120)):
        clock.now += 60.0
        decision = decide(memory, Sampled(driver.read()), now, limits)
        if now in said:
            decision = decide(decision.memory, said[now], now, limits)
        memory, module.reply = decision.memory, module.answer
        if now == lost_at:
            loses_replies(module)
        try:
            driver.write(decision.outputs)
        except DriverError as error:
            memory = decide(memory, WriteFailed(str(error)), now, limits).memory
        told += [(now, pdu) for pdu in writes(module)]
        module.asked.clear()
    return told


@pytest.mark.parametrize(
    ("relay", "on_s", "told"), [(0, 0.7, "0105020000078db0"), (1, 0.8, "0105020100089c74")]
)
def test_a_flash_has_the_frames_of_the_makers_manual(
    line: SerialModule, relay: int, on_s: float, told: str
) -> None:
    """Expect the frames in the manual of the Waveshare Modbus RTU Relay: "flash on" for 700 ms and for
    800 ms."""
    line.on_wire = lambda heard: heard
    coil = f"unit 1 coil {relay}"
    lines = bus_to(line.port).lines({}, {coil: False})
    lines.flash(coil, Flash(f"unit 1 coil 0x{0x200 + relay:x}", on_s))
    assert [heard.hex() for heard in line.frames] == [told]


def test_the_longest_pulse_of_a_yaml_fits_into_the_request(either: Module) -> None:
    bus_to(either.port).lines({}, {COIL: False}).flash(COIL, Flash(FLASH.point, 600.0))
    assert writes(either) == ["0502001770"]


def test_a_flash_whose_reply_is_lost_is_a_failure_and_is_not_sent_again(either: Module) -> None:
    loses_replies(either)
    lines = bus_to(either.port, timeout_s=1.0, retries=3).lines({}, {COIL: False})
    with pytest.raises(HalError, match=r"flash at coil 0x200: no reply within 1 s, tried 1x"):
        lines.flash(COIL, FLASH)
    assert writes(either) == [FLASH_PDU]


@pytest.mark.parametrize("pdu", ["0502000008", "0502010007", "050200ff00", "05020000"])
def test_the_echo_of_another_flash_does_not_count_as_an_answer(either: Module, pdu: str) -> None:
    either.reply = lambda request: frame(request, bytes.fromhex(pdu))
    lines = bus_to(either.port, timeout_s=1.0).lines({}, {COIL: False})
    with pytest.raises(HalError, match="tried 1x"):
        lines.flash(COIL, FLASH)


def test_a_board_that_cannot_flash_says_so(line: SerialModule) -> None:
    line.on_wire = lambda heard: rtu("018502")
    with pytest.raises(HalError, match="flash at coil 0x200: exception 2, illegal data address"):
        bus_to(line.port).lines({}, {COIL: False}).flash(COIL, FLASH)


def test_a_coil_that_goes_off_by_itself_after_a_flash_is_not_a_trip(either: Module) -> None:
    driver = claimed(either)
    driver.write(PULSE)
    for level in (True, False):
        either.coils[1, 0] = level
        driver.read()
    driver.write(BETWEEN)
    driver.read()
    assert writes(either) == [FLASH_PDU]


def test_a_pulse_is_asked_for_once_and_the_next_one_again(either: Module) -> None:
    driver = claimed(either)
    for outputs in (PULSE, PULSE, BETWEEN, BETWEEN, PULSE, PULSE):
        driver.write(outputs)
    assert writes(either) == [FLASH_PDU] * 2


def test_a_pulse_whose_reply_was_lost_is_not_repeated_but_the_next_is_sent(either: Module) -> None:
    clock = Time()
    driver = claimed(either, clock=clock, timeout_s=1.0)
    loses_replies(either)
    with pytest.raises(HalError):
        driver.write(PULSE)
    either.reply = either.answer
    wait_until(lambda: answers(driver, clock), "the unit is read again")
    for _ in range(3):
        driver.open()
        driver.read()
        driver.write(PULSE)
    assert writes(either) == [FLASH_PDU]
    driver.write(BETWEEN)
    driver.write(PULSE)
    assert writes(either) == [FLASH_PDU] * 2


def test_a_hold_that_ends_during_a_pulse_switches_off_at_once_and_verifies_it(
    either: Module,
) -> None:
    driver = claimed(either)
    driver.write(PULSE)
    either.coils[1, 0] = True
    driver.write(RELEASE)
    driver.write(RELEASE)
    assert (writes(either), either.coils[1, 0]) == ([FLASH_PDU, "0500000000"], False)


def test_a_door_that_was_let_go_while_it_could_not_be_seen_is_flashed_again(either: Module) -> None:
    driver = claimed(either)
    for outputs in (PULSE, BETWEEN, RELEASE, PULSE):
        driver.write(outputs)
    assert writes(either) == [FLASH_PDU, "0500000000", FLASH_PDU]


def test_make_safe_after_a_flash_switches_off_and_sees_a_relay_that_stays_on(
    either: Module,
) -> None:
    driver = claimed(either)
    driver.write(PULSE)
    driver.make_safe()
    assert writes(either) == [FLASH_PDU, "0500000000"]
    either.coils[1, 0] = True
    either.reply = lambda request: (
        frame(request, request[7:12]) if request[7] == 5 else either.answer(request)
    )
    with pytest.raises(DriverError, match="unit 1 coil 0 reads 1 after 0 was written"):
        driver.make_safe()


def test_closing_after_a_flash_switches_off(either: Module) -> None:
    driver = claimed(either)
    driver.write(PULSE)
    driver.close()
    assert writes(either) == [FLASH_PDU, "0500000000"]


def test_a_door_that_rmf_holds_is_flashed_by_one_clock_and_switched_off_when_it_is_let_go(
    either: Module,
) -> None:
    flashes = [(1.0, FLASH_PDU), (4.0, FLASH_PDU), (7.0, FLASH_PDU)]
    assert held(either) == [*flashes, (9.0, "0500000000")]


def test_a_pulse_whose_request_may_be_lost_is_asked_for_again_when_it_must_be_over(
    module: Module,
) -> None:
    """DOOR-PULSES-2: the pulse of 0.7 s was asked for at 4 s. A request within it would prolong it."""
    flashes = [(at, FLASH_PDU) for at in (1.0, 4.0, 4.875, 7.875)]
    assert held(module, lost_at=4.0) == [*flashes, (9.0, "0500000000")]


@contextmanager
def site(serial: modbus.Serial | None, on_s: float) -> Iterator[tuple[DryContactDoor, DoorPlant]]:
    """Yield a driver, and the quick simulated door behind the simulated module."""
    settings = pulsed(on_s, every_s=600.0)
    plant = DoorPlant("door", wires(settings), open_s=0.05, close_s=0.05, auto_close_s=0.05)
    world = RealTime({"door": plant})
    wired = [PlantWiring(plant, wires(settings), modbus.canonical)]
    with on_modbus(world, wired, serial, timeout_s=5.0) as (bus, _):
        driver = create("door", settings, bus)
        driver.open()
        yield driver, plant
        driver.close()


@pytest.fixture(params=[None, RS485], ids=["tcp", "rtu"])
def serial(request: pytest.FixtureRequest) -> modbus.Serial | None:
    where: modbus.Serial | None = request.param
    return where


def relay(plant: DoorPlant) -> list[object]:
    return [edge.value for edge in plant.edges if edge.what == "relay"]


def test_the_fake_module_ends_the_pulse_by_itself_and_never_before_its_time(
    serial: modbus.Serial | None,
) -> None:
    with site(serial, on_s=0.3) as (driver, plant):
        driver.write(PULSE)
        assert relay(plant) == [True]
        wait_until(lambda: relay(plant) == [True, False], "the module ends the pulse")
        on, off = (edge.at for edge in plant.edges if edge.what == "relay")
        assert off - on >= 0.3 - 1e-6
        wait_until(lambda: bool(driver.read().closed), "the operator closes the door")
        driver.write(PULSE)
        assert relay(plant) == [True, False]
        driver.write(BETWEEN)
        driver.write(PULSE)
        assert relay(plant) == [True, False, True]


def test_the_fake_modules_pulse_is_ended_by_a_coil_that_is_written_off(
    serial: modbus.Serial | None,
) -> None:
    with site(serial, on_s=300.0) as (driver, plant):
        driver.write(PULSE)
        wait_until(lambda: bool(driver.read().opened), "the door opens")
        driver.make_safe()
        assert relay(plant) == [True, False]


@pytest.mark.parametrize(
    ("flash", "problem"),
    [
        ("unit 1 coil 0x207", ""),
        (
            "unit 2 coil 0x200",
            "30:7: 'hold_open': flash is at unit 2, but the relay is at unit 1: correct one",
        ),
        (
            "unit 1 discrete input 9",
            "30:7: 'hold_open': flash is a write to a coil, not to a discrete input",
        ),
        (
            "unit 1 coil 0",
            "30:64: unit 1 coil 0 is used by ward_door outputs.hold_open on line 30:"
            " ward_door outputs.hold_open needs a point of its own",
        ),
        (
            "0x200",
            "30:64: '0x200' is not a Modbus point: write 'unit 1 coil 0',"
            " 'unit 1 discrete input 0' or 'unit 1 holding register 0 bit 0'; addresses begin at 0",
        ),
    ],
)
def test_an_impossible_flash_is_reported_where_it_stands(
    tmp_path: Path, flash: str, problem: str
) -> None:
    text = SHIPPED.read_text().replace('"unit 1 coil 0x200"', f'"{flash}"')
    assert problems_of(tmp_path / "door.yaml", text) == ([problem] if problem else [])


def test_no_board_times_the_pulses_of_a_pin() -> None:
    wire = Wire("hold_open", "out", "BCM17", "high", flash=Flash("BCM27", 0.5))
    text = "flash is only for Modbus modules that end pulses themselves: delete flash"
    assert list(gpio.wire_problems(wire)) == [text]


def test_check_says_where_a_pulse_is_asked_for_and_how_long_it_lasts() -> None:
    rows = lines(findings(load(SHIPPED)), 200)
    assert "unit 1 coil 0 (00001), 0.7 s by the module at unit 1 coil 0x200" in "\n".join(rows)
