"""The place that is reported for a robot: after a silence, on another map, off the graph, and after a
lift ride (FLEET-5, FLEET-6, FLEET-7)."""

import math
from typing import Any

import pytest

from bridges.kinds.fleet.places import off_line_m
from bridges.kinds.fleet.signals import Localize, Pose, Stop
from bridges.kinds.shared.decision import Fault, Suspended
from tests.kinds.fleet.story import GRAPH, SITE, Story, at, driving, goal


def test_rmf_gets_no_place_that_was_not_read() -> None:  # FLEET-5
    story = Story().see().silence(1.0)
    assert story.report.at is None
    assert story.faults == ["ROBOT_NOT_READ"]
    assert story.report.fit
    story.silence(4.1)
    reason = "192.168.1.80:22011 refuses the connection"
    assert story.report.faults == (Fault("ROBOT_SILENT", reason),)
    assert not story.report.fit
    story.see()
    assert (story.report.at, story.report.fit, story.faults) == (at(0.0), True, [])


def test_the_core_wakes_when_the_robot_becomes_silent() -> None:
    story = Story().see()
    assert story.wake_at == story.now + 5.0


def test_a_robot_that_never_answers_is_silent() -> None:
    story = Story().silence(5.1)
    assert (story.report.at, story.report.fit, story.faults) == (None, False, ["ROBOT_SILENT"])


def test_a_suspended_daemon_has_no_place() -> None:
    assert Story().see().take(Suspended("nothing was read for 9 s")).report.at is None


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"battery": 1.5}, "its battery is 150 %: is the unit right?"),
        ({"battery": -0.1}, "its battery is -10 %: is the unit right?"),
        ({"battery": math.nan}, "its battery is nan %: is the unit right?"),
        ({"at": Pose("L1", math.nan, 0.0)}, "its place is no number"),
        ({"at": Pose("L1", 0.0, math.inf)}, "its place is no number"),
        ({"at": Pose("L1", 0.0, 0.0, math.nan)}, "its place is no number"),
    ],
)
def test_an_implausible_reading_never_reaches_rmf(
    changes: dict[str, Any], says: str
) -> None:  # FLEET-SENSING-1
    story = Story().see().see(**changes)
    assert story.report.at is None
    assert story.report.faults == (Fault("ROBOT_NOT_READ", says),)


def test_a_battery_a_little_above_full_is_full() -> None:  # FLEET-SENSING-1
    assert Story().see(battery=1.01).report.battery == 1.0


def test_an_old_reading_does_not_count() -> None:  # FLEET-SENSING-2
    story = Story().see(said_at=50.0).see(4.875)
    assert story.faults == []
    story.see(0.125)
    assert (story.report.at, story.faults) == (None, ["ROBOT_SILENT"])
    assert story.see(said_at=56.0).report.at == at(0.0)


def test_a_time_that_is_slower_than_the_readings_is_no_fault_and_brings_no_new_place() -> None:
    """FLEET-SENSING-2. The manager counts whole seconds."""
    story = Story().see(said_at=50.0)
    before = story.report
    story.see(0.75, at=at(1.0))
    assert story.report == before
    assert story.silence(0.125).see().faults == ["ROBOT_NOT_READ"]
    assert story.see(said_at=51.0).report.at == at(1.0)


def test_a_reading_that_is_repeated_shows_no_robot_that_stands() -> None:  # FLEET-SENSING-2 and 3
    story = driving(7, said_at=50.0).order(Stop(8, of=7)).see(4.5)
    assert story.memory.command is not None
    assert story.see(said_at=54.0).memory.command is None


def test_a_robots_clock_may_be_set_back() -> None:  # FLEET-SENSING-2
    story = Story().see(said_at=50.0)
    story.now += 1.0
    assert story.see(said_at=10.0).report.at is None
    story.now += 4.0
    assert story.see(said_at=14.0).report.at == at(0.0)


def test_a_robot_that_turns_on_the_spot_does_not_stand() -> None:  # FLEET-SENSING-3
    story = driving(7, to=goal(0.0))
    for n in range(30):
        story.now += 0.1
        story.see(at=at(0.0, yaw=n / 10))
    assert story.report.finished == 0


def test_another_map_is_named_and_not_sent() -> None:  # FLEET-6
    story = Story().see(at=Pose("basement", 0.0, 0.0))
    assert story.report.at is None
    text = "it is on the map 'basement', but the graph has L1, L2"
    assert story.report.faults == (Fault("ROBOT_ON_OTHER_MAP", text),)
    assert not story.report.fit


def test_off_the_graph_the_distance_is_reported_and_the_place_is_sent() -> None:  # FLEET-6
    story = Story().see(at=at(3.0, 4.0))
    assert story.report.at == at(3.0, 4.0)
    text = "4 m from the nearest lane"
    assert story.report.faults == (Fault("ROBOT_OFF_GRAPH", text),)
    assert story.report.fit
    assert story.see(at=at(3.0, 0.5)).faults == []


def test_after_a_ride_rmf_gets_no_place_of_the_old_floor() -> None:  # FLEET-7
    story = Story().see(at=at(8.0))
    story.order(Localize(7, goal(8.0, level="L2")))
    assert (story.report.at is None, story.report.activity) == (True, 7)
    story.see(2.0)
    assert story.report.at is None
    there = story.see(at=at(8.4, level="L2")).report
    assert (there.at, there.finished) == (at(8.4, level="L2"), 7)


def test_a_robot_that_finds_itself_elsewhere_on_the_new_floor_is_not_localized() -> None:  # FLEET-7
    story = Story().see(at=at(8.0), moving=False).order(Localize(7, goal(8.0, level="L2")))
    story.see(10.0, at=at(8.0, 9.0, level="L2"))
    assert (story.report.at, story.report.finished) == (None, 0)
    assert story.commands[-1] == (10.0, "localize 7, attempt 2")


def test_the_conversions_between_both_maps_are_inverse() -> None:
    place = Pose("L1", 3.0, -2.0, 0.5)
    back = SITE.on_rmfs_map(SITE.on_robots_map(place))
    assert (back.map, *(round(v, 9) for v in (back.x, back.y, back.yaw))) == ("L1", 3.0, -2.0, 0.5)


def test_the_distance_from_the_graph_counts_lanes_and_lone_vertices() -> None:
    assert GRAPH.off_m(Pose("L1", 2.5, 2.0)) == 2.0
    assert GRAPH.off_m(Pose("L1", -3.0, 4.0)) == 5.0
    assert off_line_m(here := Pose("L1", 1.0, 1.0), here, Pose("L1", 1.0, 3.0)) == 2.0
    assert GRAPH.off_m(Pose("L3", 0.0, 0.0)) == math.inf
