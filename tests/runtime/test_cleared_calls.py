"""A lift controller may take a call and then reset the call's register or coil to zero. The daemon must
not report such a controller as a second master.

A real second master may write the same register or coil. Then the daemon's log must name it.

Only the lift is simulated. The daemon's service with its clock, the Modbus line, and the second
master's connection are real. On RS-485 the second master uses the module's network port.
"""

import logging
import re
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import groupby
from pathlib import Path
from typing import Final

import msgspec
import pytest

from bridges.messages.constants import LiftDoor, LiftMode, LiftRequestDoor, LiftRequestType
from bridges.messages.definitions import LiftRequest, LiftState
from bridges.messages.topics import LIFT_REQUESTS, LIFT_STATES
from bridges.runtime.service import service
from bridges.runtime.serving import stop
from bridges.settings.load import Config, load
from drivers.hal.modbus import ModbusBus, ModbusSettings, Serial, canonical
from drivers.hal.modbus.points import Point, parse
from drivers.hal.modbus.registers import at
from drivers.lift.dry_contact import wires
from hal_fakes.modbus import ModbusServer, register_lift
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.modbus.units import FarSide
from hal_fakes.plants.lift import LiftPace, LiftPlant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until

CONFIG: Final = Path(__file__).parents[2] / "config"
PACE: Final = LiftPace(floor_s=0.7, door_s=0.3, agv_s=0.1, dwell_s=1.0)
RS485: Final = Serial(port="/dev/null", baudrate=115200, parity="none", stopbits=1)
WATCHDOG: Final = "\n    module_watchdog: {units: [1], profile: wago-750}"
GATEWAY, CONTACTS = "lift_gateway.yaml", "lift_io_module.yaml"
TIMEOUT_S: Final = 2.0


class Site:
    """One lift with its daemon, and RMF. `another` is a second master's bus to the lift's units."""

    def __init__(self, config: Config, clears_s: float | None, rtu: bool, held: ExitStack) -> None:
        self.states: list[LiftState] = []
        settings = config.devices["Lift1"]
        gateway = config.driver == "register"
        build = register_lift.build if gateway else LiftPlant
        world = RealTime({"Lift1": build("Lift1", settings, PACE)})
        self.plant = world.plants["Lift1"]
        far_side: FarSide = (
            register_lift.FakeRegisterLift(self.plant, settings, clears_s)
            if gateway
            else PlantWiring(self.plant, wires(settings), canonical, clears_s)
        )
        self.server = (
            RtuLine([far_side], RS485, slow_s=1.0) if rtu else ModbusServer([far_side], slow_s=1.0)
        )
        beside = ModbusServer(self.server.units, slow_s=1.0)
        self.bus = bus_at(self.server.replace)
        self.another = bus_at(beside.replace)
        network = MemoryNetwork()
        rmf = MemoryTransport(network, "rmf")
        rmf.subscribe(LIFT_STATES, self.states.append)
        self._requests = rmf.publisher(LIFT_REQUESTS)
        served = service(config, MemoryTransport(network, "lift"), lambda name: self.bus)
        served.subscribe()
        (loop,) = served.loops
        for close in (world.close, self.server.close, beside.close, self.another.close):
            held.callback(close)
        held.callback(stop, [loop], 10.0)
        loop.start()
        wait_until(self._is_up, "the lift is in service")

    def _is_up(self) -> bool:
        return bool(self.states) and self.states[-1].current_mode == LiftMode.MODE_HUMAN

    def request(self, floor: str) -> None:
        asked = LiftRequest(
            lift_name="Lift1",
            session_id="fleet/robot",
            request_type=LiftRequestType.REQUEST_AGV_MODE,
            destination_floor=floor,
            door_state=LiftRequestDoor.DOOR_OPEN,
        )
        self._requests.publish(asked)

    def rides(self, floor: str) -> None:
        """Ride to a floor in AGV mode, until the door is open at that floor."""

        def there() -> bool:
            self.request(floor)
            last = self.states[-1]
            opened = (
                last.door_state == LiftDoor.DOOR_OPEN and last.current_mode == LiftMode.MODE_AGV
            )
            return opened and last.current_floor == floor

        wait_until(there, f"the lift stands open at {floor}")

    def modes(self) -> list[int]:
        """Return the modes in order. The first is the mode when the lift came into service."""
        modes = [mode for mode, _ in groupby(state.current_mode for state in self.states)]
        return modes[modes.index(LiftMode.MODE_HUMAN) :]

    def called(self) -> bool:
        """Ask for L3. Return whether the call relay for L3 has switched."""
        self.request("L3")
        return bool(self.relay("call_L3"))

    def relay(self, signal: str) -> list[object]:
        """Return each value to which this relay has switched."""
        edges = list(self.plant.edges)
        return [e.value for e in edges if e.what == "relay" and e.signal == signal]


def bus_at(place: dict[str, object]) -> ModbusBus:
    plain = {"type": "modbus", "timeout_s": TIMEOUT_S, **place}
    return ModbusBus(msgspec.convert(plain, ModbusSettings))


def configured(example: str, folder: Path, *changes: tuple[str, str]) -> Config:
    text = (CONFIG / example).read_text().replace(WATCHDOG, "")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / example).write_text(text)
    return load(folder / example)


@pytest.fixture
def held() -> Iterator[ExitStack]:
    with ExitStack() as held:
        yield held


@pytest.fixture(params=[False, True], ids=["tcp", "rtu"])
def rtu(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


def spoken(caplog: pytest.LogCaptureFixture) -> list[str]:
    """Return the warnings and errors in the log."""
    return [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]


def is_told(point: Point, caplog: pytest.LogCaptureFixture) -> bool:
    """Return whether a `device_lost` line in the log names another master that writes this point."""
    lost = [text for text in spoken(caplog) if text.startswith("device_lost")]
    return any("another master writes" in text and str(point) in text for text in lost)


SPOILED: Final = re.compile(r"is not a frame|no reply within")
"""Texts in the log after a busy machine has split a frame on the serial line or delayed a reply."""


def ridden(
    make: Callable[[], Site], held: ExitStack, caplog: pytest.LogCaptureFixture, *floors: str
) -> Site:
    """Ride to these floors, and return the site. If a busy machine spoils a frame, ride again on a new
    site."""
    for _ in range(10):
        site = make()
        for floor in floors:
            site.rides(floor)
        if not any(SPOILED.search(text) for text in spoken(caplog)):
            break
        held.pop_all().close()
        caplog.clear()
    return site


PLACES: Final = {
    GATEWAY: ["unit 1 holding register 11"],
    CONTACTS: ["unit 1 coil 4", "unit 1 coil 2"],
}
READ_BACK: Final = {
    GATEWAY: ("          none: 0", "          none: 0\n          read_back: false"),
    CONTACTS: (
        '"unit 1 coil 4", active: high}',
        '"unit 1 coil 4", active: high, read_back: false}',
    ),
}


@pytest.mark.long(6)
@pytest.mark.parametrize("clears_s", [0.01, 0.05])
@pytest.mark.parametrize("example", [GATEWAY, CONTACTS])
def test_a_lift_that_clears_its_calls_is_ridden_without_a_fault_and_the_place_is_named_with_the_key(
    example: str,
    clears_s: float,
    rtu: bool,
    tmp_path: Path,
    held: ExitStack,
    caplog: pytest.LogCaptureFixture,
) -> None:
    config = configured(example, tmp_path)
    site = ridden(lambda: Site(config, clears_s, rtu, held), held, caplog, "L3", "L1")
    assert site.modes() == [LiftMode.MODE_HUMAN, LiftMode.MODE_AGV]
    assert site.relay("agv_mode_request") == [True]
    told = spoken(caplog)
    assert [text.split(" reason")[0] for text in told] == [
        f'call_cleared place="{place}"' for place in PLACES[example]
    ]
    assert all("write read_back: false at this command. Otherwise another" in text for text in told)


@pytest.mark.long(4)
@pytest.mark.parametrize("example", [GATEWAY, CONTACTS])
@pytest.mark.parametrize("by", ["read_back", "pulse"])
def test_with_the_key_or_with_pulses_a_lift_that_clears_its_calls_logs_nothing(
    example: str,
    by: str,
    rtu: bool,
    tmp_path: Path,
    held: ExitStack,
    caplog: pytest.LogCaptureFixture,
) -> None:
    pulse = ("    floors: [L1", "    limits: {call_pulse_s: 0.5}\n    floors: [L1")
    change = READ_BACK[example] if by == "read_back" else pulse
    config = configured(example, tmp_path, change)
    site = ridden(lambda: Site(config, 0.05, rtu, held), held, caplog, "L3")
    assert site.modes() == [LiftMode.MODE_HUMAN, LiftMode.MODE_AGV]
    assert spoken(caplog) == []


OTHERS_CALL: Final = {
    GATEWAY: (at(1, "holding register 11"), 2),
    CONTACTS: (parse("unit 1 coil 3"), 1),
}
SERVED: Final = {
    "the call": {GATEWAY: at(1, "holding register 11"), CONTACTS: parse("unit 1 coil 4")},
    "AGV mode": {GATEWAY: at(1, "holding register 10"), CONTACTS: parse("unit 1 coil 0")},
}


@pytest.mark.long(8)
@pytest.mark.parametrize("example", [GATEWAY, CONTACTS])
@pytest.mark.parametrize(
    ("clears_s", "what"), [(None, "the call"), (None, "AGV mode"), (0.05, "AGV mode")]
)
def test_another_master_that_switches_our_command_off_is_told(
    example: str,
    clears_s: float | None,
    what: str,
    rtu: bool,
    tmp_path: Path,
    held: ExitStack,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """The second master writes 0 twice a second. The test runs with a controller that keeps its calls,
    and with one that clears them."""
    point = SERVED[what][example]
    site = Site(configured(example, tmp_path), clears_s, rtu, held)
    site.plant.fail("car", "slow")
    wait_until(site.called, "the lift is called")
    pace = threading.Event()

    def named() -> bool:
        pace.wait(0.5)
        site.called()
        site.another.write(point, 0)
        return is_told(point, caplog)

    wait_until(named, "the other master is named")


@pytest.mark.long(8)
@pytest.mark.parametrize("example", [GATEWAY, CONTACTS])
def test_another_masters_call_in_a_place_that_clears_itself_is_told(
    example: str, rtu: bool, tmp_path: Path, held: ExitStack, caplog: pytest.LogCaptureFixture
) -> None:
    site = Site(configured(example, tmp_path), 0.05, rtu, held)
    site.rides("L3")
    point, value = OTHERS_CALL[example]
    pace = threading.Event()

    def named() -> bool:
        pace.wait(0.5)
        site.another.write(point, value)
        return is_told(point, caplog)

    wait_until(named, "the other master is named")
