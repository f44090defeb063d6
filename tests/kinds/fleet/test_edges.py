"""Details of a robot's rules: all fields of commands, maps in pixels, the texts of faults, and rare
orders."""

import math

import pytest
from msgspec.structs import replace

from bridges.kinds.fleet.memory import RobotLimits
from bridges.kinds.fleet.places import Lane, NavGraph, RobotSite, Vertex
from bridges.kinds.fleet.report import RobotReport
from bridges.kinds.fleet.settings import FleetRobotSettings, RobotDurations
from bridges.kinds.fleet.signals import (
    Act,
    Goal,
    Navigate,
    PadHeard,
    Pose,
    RobotCommand,
    RobotSample,
    Stop,
)
from bridges.kinds.shared.decision import Fault, OperatorReset
from bridges.kinds.shared.similarity import Similarity
from tests.kinds.fleet.story import DOCK_A, GRAPH, LIMITS, Story, at, driving, goal

IN_PIXELS = RobotSite(
    GRAPH, {"L1": Similarity(20j, complex(7, 0), 0.0), "": Similarity(1, 0, 0.0)}, "charger_a"
)
"""A site in which the robot's map of L1 has 20 pixels for a metre, and is turned by 90 degrees.

The robot's map of L2 is the same as RMF's map.
"""


def on_pixels(x: float, y: float = 0.0) -> Pose:
    return IN_PIXELS.on_robots_map(Pose("L1", x, y))


def in_pixels() -> Story:
    """Return a story in which RMF has just ordered a robot at charger_a to drive to the pantry."""
    story = Story(
        limits=RobotLimits(RobotDurations(), IN_PIXELS), sample=RobotSample(on_pixels(0.0), 0.8)
    )
    return story.see(moving=True).order(Navigate(7, Goal(on_pixels(5.0), name="pantry")))


# ---- maps in pixels instead of metres


@pytest.mark.parametrize(("x", "finished"), [(4.4, 0), (4.51, 7), (5.49, 7), (5.6, 0)])
def test_a_robot_has_arrived_within_half_a_metre_whatever_the_unit_of_its_map(
    x: float, finished: int
) -> None:  # FLEET-2
    assert in_pixels().see(at=on_pixels(x), moving=False).report.finished == finished


def test_a_robot_that_creeps_on_a_map_in_pixels_stands_only_within_3_cm() -> None:
    """FLEET-SENSING-3. On this map 2 cm are only 0.4 pixels."""
    crept = in_pixels().see(moving=None, at=on_pixels(5.0)).see(0.75).see(0.25, at=on_pixels(5.02))
    assert crept.report.finished == 7
    drove = in_pixels().see(moving=None, at=on_pixels(5.0)).see(0.75).see(0.25, at=on_pixels(5.04))
    assert drove.report.finished == 0


def test_the_distance_from_the_graph_is_in_metres_and_is_measured_again_after_10_cm() -> None:
    """FLEET-6."""
    story = in_pixels().see(at=on_pixels(3.0, 4.0))
    assert story.report.faults == (Fault("ROBOT_OFF_GRAPH", "4 m from the nearest lane"),)
    assert story.see(at=on_pixels(3.0, 3.92)).memory.off_m == pytest.approx(4.0)
    assert story.see(at=on_pixels(3.0, 3.88)).memory.off_m == pytest.approx(3.88)
    assert story.see(at=Pose("L2", 8.0, 3.88)).memory.off_m < 1e-9
    assert story.see(at=on_pixels(3.0, 1.0)).faults == []  # exactly off_graph_m is no fault


def test_each_level_has_its_own_transform() -> None:
    assert IN_PIXELS.on_robots_map(Pose("L1", 3.0, 4.0)) == Pose("L1", 7 - 80, 60.0, math.pi / 2)
    assert IN_PIXELS.on_robots_map(Pose("L2", 3.0, 4.0)) == Pose("L2", 3.0, 4.0)
    assert IN_PIXELS.on_rmfs_map(Pose("L1", 7 - 80, 60.0, math.pi / 2)) == Pose("L1", 3.0, 4.0)
    assert (IN_PIXELS.metre("L1"), IN_PIXELS.metre("L2"), RobotSite().metre("L1")) == (
        20.0,
        1.0,
        1.0,
    )


def test_the_graph_finds_the_nearest_named_waypoint_and_the_nearest_lane() -> None:
    graph = NavGraph(
        (
            Vertex("L1", 1.0, 2.0, "a"),
            Vertex("L1", 4.0, 6.0, "b", charger=True),
            Vertex("L1", 1.1, 2.1),
            Vertex("L2", 1.0, 2.0, "c"),
        ),
        (Lane(0, 1), Lane(3, 3)),
    )
    here = Pose("L1", 1.0, 2.5)
    assert graph.nearest(here, 0.5) == graph.vertices[0]
    assert graph.nearest(here, 0.4) is None
    assert graph.nearest(here, 10.0, chargers=True) == graph.vertices[1]
    assert graph.nearest(Pose("L2", 1.0, 2.0), 10.0, chargers=True) is None
    assert graph.off_m(Pose("L1", 2.5 - 0.8, 4.0 + 0.6)) == pytest.approx(1.0)  # beside the lane
    assert graph.off_m(Pose("L1", 4.0, 7.0)) == 1.0  # beyond the lane's end
    assert graph.off_m(Pose("L2", 2.0, 2.0)) == 1.0
    assert graph.vertices[1].pose() == Pose("L1", 4.0, 6.0)


# ---- all fields of a command


def test_an_action_and_a_stop_reach_the_robot_whole() -> None:  # FLEET-1 and FLEET-11
    story = Story().see(completed="", moving=True).order(Act(9, "clean", '{"zone": "lounge"}'))
    assert story.memory.command == RobotCommand(
        9, "act", activity="clean", description='{"zone": "lounge"}'
    )
    assert story.report.doing == "clean"
    story.order(Stop(10, of=9))
    assert story.memory.command == RobotCommand(10, "stop", of=9)
    assert story.report.doing == "stop"


def test_a_refused_action_is_sent_again_by_the_time_of_its_order() -> None:  # FLEET-3
    story = Story().see(completed="", moving=False).order(Act(9, "clean"))
    story.see(5.0, refused="act is refused").see(4.875, at=at(1.0))
    assert len(story.commands) == 1
    assert story.see(0.125).commands[-1] == (10.0, "act 9, attempt 2")


def test_a_reset_gives_all_attempts_again() -> None:  # FLEET-12
    story = driving(7, moving=False).see(100.0).take(OperatorReset()).see(29.875)
    assert (story.memory.tries, story.faults) == (2, [])
    assert story.see(70.25).faults == ["ROBOT_NOT_OBEYING"]


def test_a_robot_that_leaves_its_dock_and_comes_back_gets_the_whole_time_for_its_charge() -> None:
    """FLEET-8."""
    story = Story().see(at=at(5.0), moving=True, charging=False).order(Navigate(7, DOCK_A))
    story.see(50.0, at=at(0.0), moving=False)
    story.see(at=at(0.6)).see(59.875, at=at(0.0))
    assert len(story.commands) == 1
    assert story.see(0.125).commands[-1] == (109.875 + 0.125, "dock 7, attempt 2")


def test_a_dock_that_is_ordered_anew_gets_the_whole_time_for_its_charge() -> None:  # FLEET-8
    story = Story().see(at=at(5.0), moving=True, charging=False).order(Navigate(7, DOCK_A))
    story.see(50.0, at=at(0.0), moving=False).order(Navigate(8, DOCK_A)).see(59.875)
    assert [words for _, words in story.commands] == ["dock 7, attempt 1", "dock 8, attempt 1"]


# ---- when the robot counts as standing


def test_a_stop_is_not_believed_while_the_robot_turns_on_the_spot() -> None:
    """FLEET-4 and FLEET-SENSING-3: a turn of more than 3° counts as a movement."""
    still = driving(7)
    for n in range(1, 12):
        still.now += 0.125
        still.see(at=at(0.0, yaw=math.radians(4 * n)))
    still.order(Stop(8, of=7)).see(0.75)
    assert still.memory.command is not None
    assert still.see(0.25).memory.command is None


def test_a_robot_that_has_turned_stands_a_second_later() -> None:  # FLEET-SENSING-3
    still = driving(7).order(Stop(8, of=7)).see(at=at(0.0, yaw=0.5))
    still.now += 0.125
    still.see(0.75)
    assert still.memory.command is not None
    assert still.see(0.125).memory.command is None


def test_a_robot_that_creeps_is_measured_from_the_place_where_it_began_to_stand() -> None:
    """FLEET-SENSING-3: a robot that moves in steps of 2 cm does not stand."""
    story = driving(7)
    for n in range(1, 24):
        story.now += 0.125
        story.see(at=at(n / 50))
    assert story.order(Stop(8, of=7)).see().memory.command is not None


# ---- faults and their texts


def test_a_robot_that_drives_on_is_told_at_the_second_stop_and_also_while_it_is_not_read() -> None:
    """FLEET-4."""
    story = driving(7, moving=True).order(Stop(8, of=7)).see(2.875)
    assert story.faults == []
    story.see(0.125)
    assert story.report.faults == (Fault("ROBOT_NOT_STOPPING", "it drives on after a stop"),)
    story.silence(0.125)
    assert story.faults == ["ROBOT_NOT_READ", "ROBOT_NOT_STOPPING"]


def test_a_robot_that_is_sent_again_is_no_robot_that_does_not_stop() -> None:
    assert driving(7, moving=False).see(12.0).faults == []


def test_every_fault_says_what_a_person_must_know() -> None:
    story = driving(7, moving=False).see(100.0)
    assert story.report.faults == (Fault("ROBOT_NOT_OBEYING", "3 attempts in vain: navigate"),)
    story = driving(7, moving=True).see(fault="wheel motor too hot", taken_out="manual")
    assert story.report.faults == (
        Fault("ROBOT_FAULT", "wheel motor too hot"),
        Fault("ROBOT_TAKEN_OUT", "manual"),
    )
    story = Story().see(completed="", moving=False).order(Act(9, "clean")).see(unanswered=True)
    text = "nobody knows whether clean has begun: a reset sends it again"
    assert story.report.faults == (Fault("ROBOT_ACTION_UNANSWERED", text),)
    story = driving(7, to=goal(0.0, level="L2"), completed="7", moving=False).see()
    text = "it reports arrival, but is on another map than its goal"
    assert story.report.faults == (Fault("ROBOT_NOT_THERE", text),)
    story = Story().see(at=at(5.0), charging=False).order(Navigate(7, DOCK_A))
    story.see(at=at(0.0), moving=False)
    text = "docked at dock_a without a charge"
    assert story.report.faults == (Fault("ROBOT_NOT_CHARGING", text),)


def test_a_reading_that_succeeds_again_ends_the_reason_of_the_failure() -> None:
    story = Story().see().silence(1.0).see()
    assert (story.memory.unread, story.faults) == ("", [])
    story.now += 5.0
    story.take(OperatorReset())
    assert story.report.faults == (Fault("ROBOT_SILENT", "no reading for 5.0 s"),)
    old = Story().see(said_at=50.0).see(said_at=49.0)
    assert old.report.faults == (Fault("ROBOT_NOT_READ", "its manager repeats an old reading"),)


def test_a_robot_that_charges_where_no_charger_is_stands_at_no_wrong_station() -> None:  # FLEET-9
    story = Story().see(at=at(0.0)).order(Navigate(7, DOCK_A))
    assert story.see(at=at(5.0), moving=True, charging=True).faults == []


def test_the_error_of_a_charger_is_told_at_the_robot_that_stands_there_and_at_no_other() -> None:
    error = PadHeard("charger_a", charging=False, error="foreign object")
    assert Story().see(at=at(0.0)).take(error).faults == ["CHARGER_REPORTS_ERROR"]
    assert Story().see(at=at(5.0)).take(error).faults == []


def test_a_report_says_to_people_where_the_robot_is_and_what_it_does() -> None:
    story = Story()
    story.take(OperatorReset())
    assert story.report == RobotReport(where="unknown", doing="nothing")
    story = driving(7, moving=False)
    assert (story.report.where, story.report.doing) == ("L1 charger_a", "navigate to L1 pantry")
    assert (story.report.read_at, story.report.battery) == (100.0, 0.8)
    story.see(10.0, at=at(2.5))
    assert story.report.where == "L1 between waypoints"
    assert story.report.doing == "navigate to L1 pantry (attempt 2)"
    story = Story().see().order(Navigate(8, DOCK_A))
    assert story.report.doing == "dock to L1 dock_a"
    there = at(2.0, 3.0)
    story.order(Navigate(9, goal(2.0, 3.0)))
    assert story.report.doing == f"navigate to L1 {there.x:.1f}, {there.y:.1f}"


@pytest.mark.parametrize(("battery", "good"), [(0.0, True), (1.02, True), (1.021, False)])
def test_the_bounds_of_a_battery(battery: float, good: bool) -> None:  # FLEET-SENSING-1
    assert (Story().see(battery=battery).faults == []) is good


def test_a_site_without_a_graph_knows_every_map() -> None:  # FLEET-6
    story = Story(limits=RobotLimits())
    assert story.see(at=Pose("anything", 0.0, 0.0)).faults == []
    assert story.report.at == Pose("anything", 0.0, 0.0)


def test_the_age_of_a_reading_is_no_news_and_the_end_of_a_command_is() -> None:
    before = driving(7, completed="").see().report
    assert replace(before, read_at=0.0).news() == before.news()
    assert replace(before, finished=7).news() != before.news()


def test_the_limits_are_those_of_the_file() -> None:
    durations = replace(LIMITS.t, obeys_s=3.0)
    assert RobotLimits.of(FleetRobotSettings(limits=durations), {}) == RobotLimits(durations)
