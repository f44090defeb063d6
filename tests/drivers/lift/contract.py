"""The duties of every lift driver on any bus, as tests. Each test gets its own bench.

A bench is a driver on a bus, with a simulated lift behind the bus. A test class implements `benches`
and derives from `LiftContract`. It derives from `WiredLiftContract` if its connection can fail.

The lift has the landings B1, G and 1, and stands at B1 with its door closed. The wires are
`fire_alarm`, `agv_mode`, `door_opened`, `door_closed`, `moving`, and a line for each landing.
"""

import time
from collections.abc import Callable

import pytest

from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion, Side
from drivers import DriverError
from hal_fakes.plants.lift import LiftPace
from hal_fakes.plants.plant import FailureMode
from tests.drivers import benches
from tests.drivers.benches import Contract
from tests.waiting import wait_until

QUICK = LiftPace(floor_s=0.2, door_s=0.05, agv_s=0.02, dwell_s=0.1)
"""The times (s) of the simulated lift. They are so short that the tests lose no time."""

IDLE = LiftSample("B1", DoorReading.CLOSED, motion=Motion.STOPPED, agv=False)
OFF, AGV = LiftOutputs(), LiftOutputs(agv_request=True)
CALL, HOLD = LiftOutputs(True, call="1"), LiftOutputs(True, hold_door=Side.FRONT)


class Bench(benches.Bench[LiftSample, LiftOutputs]):
    """A lift driver on a bus, with a simulated lift behind the bus."""

    def until(self, holds: Callable[[LiftSample], bool], what: str) -> list[LiftSample]:
        """Read until the condition holds. Return all readings."""
        seen: list[LiftSample] = []

        def look() -> bool:
            seen.append(self.read())
            return holds(seen[-1])

        wait_until(look, what)
        return seen

    def sees(self, edges: int) -> None:
        """Wait until the relays have changed at least `edges` times."""
        wait_until(lambda: len(self.relays()) >= edges, f"{edges} edges have come through")

    def rides(self) -> list[LiftSample]:
        """Call the car to landing 1 in AGV mode. Then hold its door open until the door reads open.

        Return all readings after the call.
        """
        self.write(AGV)
        self.until(lambda sample: sample.agv is True, "AGV mode")
        self.write(CALL)
        seen = self.until(lambda sample: sample.level == "1", "it is there")
        self.write(HOLD)
        return seen + self.until(lambda sample: sample.door is DoorReading.OPEN, "its door is open")


class LiftContract(Contract[Bench]):
    """The duties of a lift driver on any bus. Each test begins with an idle lift."""

    def test_opening_a_lift_switches_no_output(self, bench: Bench) -> None:
        bench.open()
        assert (bench.read(), bench.relays()) == (IDLE, [])

    def test_a_call_brings_the_car_and_the_door_is_held_open_there(self, bench: Bench) -> None:
        bench.open()
        seen = bench.rides()
        assert {sample.level for sample in seen if sample.door is DoorReading.OPEN} == {"1"}
        assert bench.relays() == [
            ("agv_mode_request", True),
            ("call_1", True),
            ("call_1", False),
            ("door_open", True),
        ]

    def test_a_car_on_its_way_is_moving_and_between_landings_with_its_door_closed(
        self, bench: Bench
    ) -> None:
        bench.open()
        bench.plant.fail("car", "slow")
        bench.write(AGV)
        bench.until(lambda sample: sample.agv is True, "AGV mode")
        bench.write(CALL)
        way = bench.until(lambda sample: sample.motion is Motion.MOVING, "it moves")
        way += bench.until(lambda sample: sample.level is None, "between landings")
        assert {sample.door for sample in way} == {DoorReading.CLOSED}

    def test_another_call_goes_on_after_the_one_before_it_is_off(self, bench: Bench) -> None:
        bench.open()
        bench.write(AGV)
        for level in ("G", "1", "B1"):
            bench.write(LiftOutputs(True, call=level))
        bench.sees(6)
        assert bench.relays()[1:] == [
            ("call_G", True),
            ("call_G", False),
            ("call_1", True),
            ("call_1", False),
            ("call_B1", True),
        ]

    def test_the_same_outputs_of_a_lift_are_written_once(self, bench: Bench) -> None:
        bench.open()
        for _ in range(3):
            bench.write(CALL)
        bench.sees(2)
        assert sorted(bench.relays()) == [("agv_mode_request", True), ("call_1", True)]

    def test_make_safe_and_close_each_switch_everything_off(self, bench: Bench) -> None:
        bench.open()
        for end in (bench.driver.make_safe, bench.driver.close):
            before = len(bench.relays())
            bench.write(HOLD)
            end()
            bench.sees(before + 4)
            assert sorted(bench.relays()[before:]) == [
                ("agv_mode_request", False),
                ("agv_mode_request", True),
                ("door_open", False),
                ("door_open", True),
            ]

    def test_a_fire_is_read_for_as_long_as_its_contact_says_so(self, bench: Bench) -> None:
        bench.open()
        for burns in (True, False):
            bench.plant.press("fire_alarm", burns, time.monotonic())
            hazards = {Hazard.FIRE} if burns else set()
            wait_until(
                lambda hazards=hazards: bench.read().hazards == hazards,  # type: ignore[misc]
                f"the driver reads hazards {hazards}",
            )

    @pytest.mark.parametrize(
        ("wire", "safe"),
        [
            ("fire_alarm", lambda sample: sample.hazards == {Hazard.FIRE}),
            ("agv_mode", lambda sample: sample.agv is False),
            ("door_opened", lambda sample: sample.door is DoorReading.BETWEEN),
            ("floor_1", lambda sample: sample.level is None),
        ],
    )
    def test_a_cut_wire_reads_as_the_safe_one_of_its_two_meanings(
        self, bench: Bench, wire: str, safe: Callable[[LiftSample], bool]
    ) -> None:
        bench.open()
        bench.rides()
        bench.plant.fail(wire, "off")
        bench.until(safe, f"{wire} is cut")


class WiredLiftContract(LiftContract):
    """The duties on a bus with a server and a unit. Both parts can fail."""

    @pytest.mark.parametrize("part", ["server", "unit"])
    def test_a_link_that_is_gone_is_a_driver_error_and_the_outputs_survive_it(
        self, bench: Bench, part: str
    ) -> None:
        bench.open()
        bench.rides()
        edges = bench.relays()
        bench.plant.fail(part, "off")
        wait_until(lambda: isinstance(bench.patiently(), str), "the lost link is noticed")
        with pytest.raises(DriverError):
            bench.driver.open()
        bench.plant.fail(part, None)
        wait_until(lambda: isinstance(bench.patiently(), LiftSample), "the lift is read again")
        bench.open()
        bench.write(HOLD)
        assert bench.relays() == edges

    @pytest.mark.parametrize("mode", ["garbage", "wrong", "slow", "stuck"])
    def test_every_failure_is_a_driver_error_and_never_a_false_reading(
        self, bench: Bench, mode: FailureMode
    ) -> None:
        bench.open()
        assert set(bench.until_it_fails("server", mode, lambda sample: False)) <= {IDLE}
        bench.plant.fail("server", None)
        wait_until(lambda: bench.patiently() == IDLE, "the lift reads idle again after the failure")
