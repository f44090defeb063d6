"""The watchdog of a Modbus module.

The bus arms the watchdog before it switches any output on, and refreshes the watchdog at each scan.
After a trip the bus arms the watchdog again.
"""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from bridges.settings.load import SettingsError, load
from drivers import DriverError
from drivers.door.dry_contact import create, wires
from drivers.hal import modbus
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.settings import paced
from drivers.hal.modbus.watchdog import PROFILE
from hal_fakes.caller import Caller
from hal_fakes.modbus import ModbusServer
from hal_fakes.modbus.dead_man import (
    RESTART,
    RUNNING,
    STATE,
    STOPPED,
    TIME,
    TRIGGER,
    TRIPPED,
    ModuleWatchdog,
)
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers.door.contract import CLOSED, HOLD, OPEN, Bench, quick
from tests.drivers.door.test_contract import dry
from tests.drivers.hal.modbus.module import Time
from tests.waiting import wait_until

SLOW = 600
"""A watchdog time (units of 100 ms) that is longer than any test."""


def at(address: int) -> Point:
    return Point(1, "holding register", address)


def habits(time: int) -> dict[str, Any]:
    """Return the watchdog settings of profile wago-750, but with this time (units of 100 ms)."""
    plain: dict[str, Any] = msgspec.to_builtins(PROFILE.load("wago-750"))
    plain["arm"][0]["value"] = time
    plain["armed"][0]["values"] = [time]
    return {**plain, "time_s": time / 10, "refresh_s": time / 20}


@pytest.mark.parametrize(("time", "warned"), [(20, True), (100, False)])
def test_check_warns_if_a_silent_unit_lets_another_units_watchdog_switch_off(
    time: int, warned: bool
) -> None:
    plain = {
        "tcp": {"host": "192.0.2.1"},
        "timeout_s": 0.5,
        "retries": 1,
        "module_watchdog": {"units": [1], "habits": habits(time)},
    }
    settings = msgspec.convert(plain, modbus.ModbusSettings)
    two, one = (("unit 1 coil 0", "unit 2 coil 0"), ("unit 1 coil 0",))
    found = [text for _, text in paced(settings, [], two)]
    assert any("a watchdog gets no refresh for 2." in text for text in found) is warned
    assert list(paced(settings, [], one)) == []


class Site:
    """A door at a module with a watchdog. `restart` opens a new bus, as a new daemon does."""

    def __init__(self, time: int = SLOW, units: tuple[int, ...] = (1,)) -> None:
        self.settings = dry(("unit 1 discrete input 0", "unit 1 discrete input 1", "unit 1 coil 0"))
        self.world = RealTime({"door": quick("door", wires(self.settings))})
        plant = self.world.plants["door"]
        self.dead_men = [ModuleWatchdog(unit) for unit in units]
        wiring = PlantWiring(plant, wires(self.settings), modbus.canonical)
        self.server = ModbusServer([wiring, *self.dead_men], slow_s=1.0)
        self.dog: dict[str, Any] = {"units": [1], "habits": habits(time)}
        self.buses: list[modbus.ModbusBus] = []
        self.restart()

    def restart(self) -> None:
        """Make a new bus and driver, as a new daemon does."""
        plain = {"type": "modbus", "module_watchdog": self.dog, **self.server.replace}
        clock = Time()
        self.bus = modbus.ModbusBus(msgspec.convert(plain, modbus.ModbusSettings), clock)
        self.buses.append(self.bus)
        driver = create("door", self.settings, self.bus)
        self.bench = Bench(driver, self.world.plants["door"], clock)

    def register(self, address: int) -> int:
        return self.dead_men[0].get(at(address), 0.0)

    def scan(self) -> str:
        """Read, write, and tell the bus that the scan has ended, as the daemon's loop does.

        Return the text of the last error, or "" without an error.
        """
        self.bench.clock.now += 60.0
        try:
            self.bench.driver.read()
            failure = ""
        except DriverError as error:
            failure = str(error)
        try:
            self.bench.driver.write(HOLD)
        except DriverError as error:
            failure = str(error)
        self.bus.scanned()
        return failure

    def close(self) -> None:
        for bus in self.buses:
            bus.close()
        self.server.close()
        self.world.close()


@pytest.fixture
def site() -> Iterator[Site]:
    built = Site()
    yield built
    built.close()


def test_the_watchdog_is_armed_and_read_back_before_anything_is_driven(site: Site) -> None:
    assert site.register(STATE) == STOPPED
    site.bench.driver.open()
    assert (site.register(STATE), site.register(TIME)) == (RUNNING, SLOW)
    assert (site.bench.ends(), site.bench.relay()) == (CLOSED, [])


def test_a_scan_refreshes_it_with_a_value_that_differs_from_the_last(site: Site) -> None:
    site.bench.driver.open()
    triggers = [site.register(TRIGGER)]
    for _ in range(3):
        assert site.scan() == ""
        triggers.append(site.register(TRIGGER))
    assert triggers == [1, 2, 1, 2]
    site.bus.scanned()  # too early for another refresh, because the clock has not moved
    assert site.register(TRIGGER) == 2


def test_without_scans_the_module_lets_go_by_itself() -> None:
    site = Site(time=1)
    try:
        site.bench.driver.open()
        site.bench.driver.write(HOLD)
        wait_until(lambda: site.bench.relay() == [True, False], "the module drops its outputs")
    except DriverError:  # the watchdog may trip before the test reads
        assert site.register(STATE) == TRIPPED
    finally:
        site.close()


def test_a_trip_makes_the_outputs_unknown_and_the_door_is_held_again(site: Site) -> None:
    site.bench.driver.open()
    site.scan()
    wait_until(lambda: site.bench.ends() == OPEN, "the held door reads open")
    site.dead_men[0].expire()
    wait_until(lambda: site.bench.relay() == [True, False], "the module drops its outputs")
    failures: list[str] = []

    def held_again() -> bool:
        failures.append(site.scan())
        return failures[-1] == "" and site.bench.relay() == [True, False, True]

    wait_until(held_again, "the door is held again")
    assert "watchdog tripped and switched its outputs off; it is armed again" in "".join(failures)
    assert site.register(STATE) == RUNNING
    wait_until(lambda: site.bench.ends() == OPEN, "the door reads open again")


def test_a_trip_that_nobody_drives_through_is_seen_by_reading_back(site: Site) -> None:
    site.bench.driver.open()
    site.dead_men[0].expire()
    wait_until(lambda: site.register(STATE) == TRIPPED, "the watchdog has tripped")
    site.bench.clock.now += 60.0
    site.bus.scanned()
    with pytest.raises(DriverError, match="watchdog tripped"):
        site.bench.driver.read()
    assert site.register(STATE) == RUNNING
    assert site.bench.ends() == CLOSED


def test_a_module_that_an_earlier_daemon_left_tripped_is_armed_again(site: Site) -> None:
    site.bench.driver.open()
    site.dead_men[0].expire()
    wait_until(lambda: site.register(STATE) == TRIPPED, "the watchdog has tripped")
    site.restart()
    site.bench.driver.open()
    assert (site.register(STATE), site.register(RESTART)) == (RUNNING, 1)


def test_a_watchdog_that_runs_already_is_left_running(site: Site) -> None:
    site.bench.driver.open()
    site.restart()
    site.bench.driver.open()  # a running watchdog refuses a new time
    assert site.register(STATE) == RUNNING


def test_a_module_without_the_watchdog_is_never_driven() -> None:
    site = Site(units=())
    try:
        with pytest.raises(DriverError, match="exception 2, illegal data address"):
            site.bench.driver.open()
        site.bench.driver.close()
        assert site.bench.relay() == []
    finally:
        site.close()


def test_a_watchdog_that_does_not_read_back_as_armed_is_not_believed(site: Site) -> None:
    site.dog["habits"]["armed"][0]["values"] = [SLOW + 1]
    site.restart()
    with pytest.raises(DriverError, match="does not read back as armed: compare"):
        site.bench.driver.open()
    assert site.bench.relay() == []


YAML = """\
kind: door
driver: dry_contact
buses:
  module:
    type: modbus
    tcp: {host: 127.0.0.1, port: %d}
    module_watchdog: {units: [1], profile: wago-750}
doors:
  ward_door:
    inputs:
      opened: {point: "unit 1 discrete input 0", active: high}
      closed: {point: "unit 1 discrete input 1", active: high}
    outputs:
      hold_open: {point: "unit 1 coil 0", active: high}
"""
DAEMON = """
import sys, threading
from bridges.kinds.door.signals import DoorOutputs
from bridges.settings.load import load
from drivers.door import dry_contact
from drivers.hal import modbus
config = load(sys.argv[1])
bus = modbus.ModbusBus(config.buses["module"])
door = dry_contact.create("ward_door", config.devices["ward_door"], bus)
door.open()
pause = threading.Event()
while True:
    door.read()
    door.write(DoorOutputs(hold_open=True))
    bus.scanned()
    pause.wait(0.05)
"""


def test_a_killed_daemons_door_is_let_go_by_the_module(tmp_path: Path) -> None:
    path, sock = tmp_path / "door.yaml", tmp_path / "plant.sock"
    path.write_text(YAML % 502)
    pipe = subprocess.PIPE
    fake = [sys.executable, "-m", "hal_fakes", str(path), "module", "--socket", str(sock)]
    with subprocess.Popen(fake, stdin=pipe, stdout=pipe) as far_side:
        assert far_side.stdout
        assert far_side.stdin
        path.write_text(YAML % json.loads(far_side.stdout.readline())["tcp"]["port"])
        with Caller(sock) as follow:
            follow.order("follow")
            relay = (edge.value for edge in follow.edges() if edge.what == "relay")
            with subprocess.Popen([sys.executable, "-c", DAEMON, str(path)]) as daemon:
                assert next(relay) is True
                daemon.send_signal(signal.SIGKILL)
            assert next(relay) is False
        far_side.stdin.close()


def problems_of(path: Path, dog: str) -> list[str]:
    path.write_text((YAML % 502).replace("{units: [1], profile: wago-750}", dog))
    try:
        load(path)
    except SettingsError as error:
        return [str(problem).removeprefix(f"{path}:") for problem in error.problems]
    return []


SHORT = (
    "{time_s: 1, refresh_s: %s, arm: [{at: coil 1, value: 1}], armed: [{at: coil 1, values: [1]}],"
    " refresh: {at: %s, values: [1]}}"
)


@pytest.mark.parametrize(
    ("dog", "wanted"),
    [
        ("{units: [1], profile: wago-750}", []),
        ("{units: [1], habits: " + SHORT % ("0.5", "coil 2") + "}", []),
        ("{units: [1]}", ["7:5: 'module_watchdog' needs 'habits', or a profile: wago-750"]),
        ("{units: [1, 1], profile: wago-750}", ["7:23: 'units': a unit is listed twice"]),
        (
            "{units: [1], profile: wago}",
            ["7:44: unknown profile 'wago': did you mean 'wago-750'? known here: wago-750"],
        ),
        (
            "{units: [1], habits: " + SHORT % ("0.6", "coil 2") + "}",
            [
                "7:66: 'refresh_s': one late scan would switch the outputs off: write at most 0.5, half"
                " of time_s"
            ],
        ),
        (
            "{units: [1], habits: " + SHORT % ("0.5", "input register 2") + "}",
            [
                "7:152: 'input register 2': write 'coil 0' or 'holding register 0'; addresses begin"
                " at 0"
            ],
        ),
    ],
)
def test_a_watchdog_that_cannot_be_right_is_refused_where_it_stands(
    tmp_path: Path, dog: str, wanted: list[str]
) -> None:
    assert problems_of(tmp_path / "door.yaml", dog) == wanted


def test_a_profile_that_nobody_has_tried_is_worth_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "door.yaml"
    path.write_text(YAML % 502)
    [warning] = load(path).warnings
    assert (warning.line, warning.column) == (7, 44)
    assert "nobody has tried the profile wago-750 on hardware" in warning.text
