"""The charger's core at its edges: what other stories missed in a mutation run (docs/mutation.md)."""

from msgspec.structs import replace

from bridges.kinds.charger.core import CLEARED_WITHIN_S
from bridges.kinds.charger.memory import ChargerLimits
from bridges.kinds.charger.pad import Misplaced
from bridges.kinds.charger.settings import Robot
from bridges.kinds.charger.signals import Activity as A
from bridges.kinds.charger.signals import ChargerSample, Measured
from bridges.kinds.shared.decision import Sampled
from tests.kinds.charger.story import AMR1, FULL, RESET, Story

ONE, TWO, NOBODY = "rx-1", "rx-2", ""
SERVING = replace(FULL, unrequested="serve_known")


def story(limits: ChargerLimits = FULL) -> Story:
    return Story(limits).sees((A.IDLE, NOBODY, 1))


def still_charging(it: Story) -> list[str]:
    return [fault for fault in it.faults if fault.startswith("STILL_CHARGING")]


def test_a_robot_that_another_has_displaced_gets_no_more_power_for_that_request() -> None:
    it = (
        story().event(AMR1).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1), (A.HANDSHAKE, TWO, 1))
    )
    it.sees((A.CHARGING, ONE, 2))
    assert it.powered == [False, True, True, False, False, False]
    assert still_charging(it) == ["STILL_CHARGING: req-1: left"]


def test_a_robot_that_left_full_is_still_full_when_another_has_come() -> None:
    it = (
        story()
        .event(AMR1)
        .sees((A.HANDSHAKE, ONE, 1))
        .sees((A.CHARGING, ONE, 1), battery_percent=100.0)
    )
    it.sees((A.HANDSHAKE, TWO, 1), (A.CHARGING, ONE, 1))
    assert it.powered == [False, True, False, False, False]
    assert still_charging(it) == []


def test_a_robot_served_without_a_request_gets_no_more_power_once_it_has_left() -> None:
    it = story(SERVING).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1), (A.IDLE, NOBODY, 1))
    it.sees((A.CHARGING, ONE, 1))
    assert it.powered == [False, True, True, False, False]
    assert still_charging(it) == ["STILL_CHARGING: tiny/AMR01: left"]


def test_robots_served_without_a_request_push_no_ended_request_out_of_memory() -> None:
    it = story(SERVING).event(AMR1).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1))
    for _ in range(9):
        it.sees((A.IDLE, NOBODY, 5), (A.HANDSHAKE, TWO, 1), (A.CHARGING, TWO, 1))
    it.sees((A.IDLE, NOBODY, 5)).event(AMR1)
    assert it.refused == [(it.now, "request is over")]


def test_a_good_reading_proves_a_clearing_up_to_its_last_instant() -> None:
    def shown_after(later_s: float) -> str:
        it = story().event(Sampled(ChargerSample(A.ERROR, 9, "fan", side="station"))).event(RESET)
        it.now += later_s
        it.sees((A.IDLE, NOBODY, 1))
        return it.told[-1][1]

    assert shown_after(CLEARED_WITHIN_S) == "IDLE"
    assert shown_after(CLEARED_WITHIN_S + 0.001) == "ERROR"


def test_names_of_any_script_are_readable_in_an_error() -> None:
    assert Misplaced(Robot("Räumer", "Wäsche 1")).text == (
        'wrong docking: Räumer/"Wäsche 1" is not assigned here'
    )


def test_another_receiver_is_news_and_another_age_is_not() -> None:
    report = story().event(AMR1).sees((A.HANDSHAKE, ONE, 1)).report
    assert report is not None
    assert replace(report, read_at=99.0).news() == report.news()
    assert replace(report, measured=Measured(receiver_id=TWO)).news() != report.news()
    assert replace(report, measured=Measured(receiver_id=ONE, volts=48.0)).news() == report.news()
