"""Duties of every driver of a switchable charger, on any bus.

A test class derives from `ChargerContract` and implements `benches`.
"""

import time
from collections.abc import Callable
from importlib import import_module
from typing import Any, ClassVar, Literal

import msgspec
import pytest

from bridges.kinds.charger.signals import CURRENT_FLOWS, Activity, ChargerOutputs, ChargerSample
from drivers import Driver
from drivers.hal import Bus
from hal_fakes.fake import Fake
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.plant import FailureMode, Plant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring
from tests.drivers import benches
from tests.drivers.benches import Contract
from tests.drivers.hal.modbus.module import Time
from tests.waiting import wait_until

ON, OFF, AS_IT_IS = ChargerOutputs(True), ChargerOutputs(False), ChargerOutputs(None)
PACE = 20.0
"""The speed of a simulated charger, as a multiple of the real speed. At this speed no test waits for
the charger."""

ChargerDriver = Driver[ChargerSample, ChargerOutputs]
OnDeath = Literal["stop", "keep"]


class Bench(benches.Bench[ChargerSample, ChargerOutputs]):
    """A bench with a charger. `new` makes a second driver for the same charger. The argument of `new`
    is `on_death`."""

    switch: ClassVar[str] = "power"

    def __init__(self, new: Callable[[OnDeath], ChargerDriver], plant: Plant, clock: Time) -> None:
        super().__init__(new("stop"), plant, clock)
        self.new = new

    def press(self, signal: str, there: bool = True) -> None:
        """Let an object come to the pad, or leave the pad if `there` is false. `signal` names the
        object."""
        self.plant.press(signal, there, time.monotonic())

    def switched(self, signal: str = "") -> list[object]:
        """Return every command so far for this signal. Without a signal, return the commands for
        `switch`."""
        wanted = signal or self.switch
        return [value for name, value in self.relays() if name == wanted]

    def scan(self, outputs: ChargerOutputs) -> Activity:
        """Run one scan, and return the station's activity."""
        activity = self.read().activity
        self.write(outputs)
        return activity

    def until(self, activity: Activity, outputs: ChargerOutputs) -> None:
        """Scan until the station shows this activity."""
        wait_until(lambda: self.scan(outputs) is activity, f"the station is {activity}")

    def does(self) -> Activity | None:
        """Return the activity after all pauses of the bus, or None if the station cannot be read."""
        found = self.patiently()
        return None if isinstance(found, str) else found.activity


def behind(driver: Any, settings: Any, canonical: Callable[[str], str] = str) -> tuple[Any, Any]:
    """Return a world that runs this driver's simulated charger at PACE. Also return the far side for
    the bus.

    The far side is the simulated station. Without a station, the far side consists of wires.
    """
    table = list(driver.DRIVER.wires(settings))
    fake: Fake[Any] = import_module(driver.DRIVER.fake or "hal_fakes.plants.charger").FAKE
    plant = fake.plant("a", settings, table)
    assert isinstance(plant, ChargerPlant)
    plant.pace = PACE
    world = RealTime({"a": plant})
    if fake.station:
        return world, fake.station(world.plants["a"], settings)
    return world, PlantWiring(world.plants["a"], table, canonical)


def news(driver: Any, settings: Any, bus: Bus) -> Callable[[OnDeath], ChargerDriver]:
    """Return a function that makes drivers with these settings. The function's argument is
    `on_death`."""

    def new(on_death: OnDeath) -> ChargerDriver:
        changed = msgspec.structs.replace(settings, on_death=on_death)
        made: ChargerDriver = driver.create("a", changed, bus)
        return made

    return new


class ChargerContract(Contract[Bench]):
    """The contract on any bus. Each bench begins with an empty pad."""

    link: ClassVar[str]
    """The part of the simulated charger whose failure breaks the wire."""
    cut: ClassVar[str] = ""
    """A part whose failure `off` breaks the wire and does not disturb the station.

    The value "" means that `link` is such a part.
    """
    measures: ClassVar[bool] = True
    """Does the station measure the current?"""
    foreign_object: ClassVar[str] = "foreign object"
    """The error text of the station for a foreign object."""

    def test_an_idle_station_is_sent_nothing(self, bench: Bench) -> None:
        bench.open()
        assert [bench.scan(outputs) for outputs in (AS_IT_IS, OFF, AS_IT_IS)] == [Activity.IDLE] * 3
        assert True not in bench.switched()

    def test_a_robot_is_charged_while_the_power_is_on_and_not_a_moment_longer(
        self, bench: Bench
    ) -> None:
        bench.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        assert bool(bench.driver.read().measured.amps) == self.measures
        bench.until(Activity.IDLE, OFF)
        assert bench.switched() == [True, False]

    def test_the_same_level_again_sends_no_command(self, bench: Bench) -> None:
        bench.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        for _ in range(3):
            bench.scan(ON)
        assert bench.switched() == [True]

    def test_without_a_wanted_level_a_charge_stays_as_it_is(self, bench: Bench) -> None:
        bench.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        assert [bench.scan(AS_IT_IS) for _ in range(3)] == [Activity.CHARGING] * 3
        assert bench.switched() == [True]

    def test_a_new_daemon_finds_a_charge_and_can_stop_it(self, bench: Bench) -> None:
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.driver = bench.new("stop")
        bench.open()
        assert bench.scan(AS_IT_IS) is Activity.CHARGING
        assert bench.scan(ON) is Activity.CHARGING
        assert bench.switched() == [True]
        bench.until(Activity.IDLE, OFF)
        assert bench.switched() == [True, False]

    def test_the_daemons_end_stops_a_charge_or_keeps_it_as_the_yaml_says(
        self, bench: Bench
    ) -> None:
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        keeps = bench.new("keep")
        keeps.open()
        keeps.make_safe()
        keeps.close()
        assert bench.scan(AS_IT_IS) is Activity.CHARGING
        bench.driver.make_safe()
        bench.driver.close()
        bench.until(Activity.IDLE, AS_IT_IS)
        assert bench.switched() == [True, False]

    def test_an_error_is_read_with_its_text(self, bench: Bench) -> None:
        bench.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.press("foreign_object")
        bench.until(Activity.ERROR, OFF)
        assert self.foreign_object in bench.driver.read().error_text
        assert bench.switched()[-1] is False

    def test_a_check_of_the_range_is_sent_once_for_a_rise(self, bench: Bench) -> None:
        bench.open()
        for checks in (0, 1, 1, 2, 2):
            bench.driver.read()
            bench.driver.write(ChargerOutputs(False, range_checks=checks))
        assert len(self.checks(bench)) == 2

    def checks(self, bench: Bench) -> list[object]:
        """Return every command so far that orders a range check."""
        return bench.switched("range_check")

    @pytest.mark.parametrize("mode", ["off", "slow", "garbage", "wrong"])
    def test_every_failure_is_a_driver_error_and_never_reads_as_charging(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        bench.open()
        seen = bench.until_it_fails(self.link, mode, _is_unknown)
        assert not CURRENT_FLOWS & {sample.activity for sample in seen}
        bench.plant.fail(self.link, None)
        wait_until(
            lambda: bench.does() is Activity.IDLE, "the station is idle again after the failure"
        )

    def test_a_charge_survives_a_link_that_goes_away_and_comes_back(self, bench: Bench) -> None:
        bench.open()
        bench.press("robot")
        bench.until(Activity.CHARGING, ON)
        bench.plant.fail(self.cut or self.link, "off")
        wait_until(lambda: bench.does() is None, "the lost link is noticed")
        bench.plant.fail(self.cut or self.link, None)
        wait_until(
            lambda: bench.does() is Activity.CHARGING,
            "the station charges again after the link is back",
        )
        bench.scan(ON)
        assert bench.switched() == [True]


def _is_unknown(sample: ChargerSample) -> bool:
    return sample.activity is Activity.UNKNOWN


class MovingPadContract(Contract[Bench]):
    """The contract of a driver that reads the pad's height and the robot's range."""

    celsius: ClassVar[tuple[str, ...]] = ()
    """The names of the temperatures that the driver reads."""

    def test_height_and_range_are_read_as_they_are(self, bench: Bench) -> None:
        bench.open()
        assert self.pad(bench, (False, False))
        bench.press("robot")
        assert self.pad(bench, (True, True))
        bench.press("misparked")
        assert self.pad(bench, (True, False))
        bench.press("misparked", False)
        bench.plant.fail("pad", "off")
        assert self.pad(bench, (False, True))

    def test_temperatures_are_read_by_their_names(self, bench: Bench) -> None:
        bench.open()
        found = bench.read().measured.temperatures
        assert tuple(name for name, _ in found) == self.celsius
        assert all(20 <= celsius <= 30 for _, celsius in found)

    def pad(self, bench: Bench, wanted: tuple[bool, bool]) -> bool:
        """Wait until the driver reads these values. `wanted` is (at height, range ok)."""

        def shown() -> bool:
            bench.write(OFF)
            found = bench.read().measured
            return (found.at_height, found.range_ok) == wanted

        wait_until(shown, f"height and range are {wanted}")
        return True
