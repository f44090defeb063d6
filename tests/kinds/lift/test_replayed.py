"""RMF's supervisor hears requests of earlier rides again, and passes them to the lift's node.

The first tests use stand-ins that follow RMF's rules. The other tests check our rules one by one.
"""

from collections.abc import Mapping

import pytest

from bridges.kinds.lift.memory import Doubted, LiftSession
from bridges.kinds.lift.replayed import LASTS_S, MOST, doubt, noted
from bridges.kinds.lift.signals import DoorReading, EndRequested, LiftRequested, LiftSample, Motion
from tests.kinds.lift.rmf_world import World
from tests.kinds.lift.story import AGV, END, Building
from tests.kinds.lift.test_forgotten import Overheard
from tests.kinds.lift.test_with_rmf import A, B, ons, sessions, world
from workbench.rmf_model.robot import RobotContext

OPEN_FOR_A = "AGV, open at L2, fleet/a to L2"


def on_its_threshold(rides_before: int) -> tuple[World, RobotContext]:
    """Return the stand-ins of RMF and a robot that enters the car at L3, after this number of earlier
    rides."""
    robot = RobotContext(A)
    rmf = world(robot)
    for _ in range(rides_before):
        rmf.rides(robot, "L2", "L1")
    rmf.asks(robot, "L3")
    rmf.until_done(robot)
    rmf.run(rmf.story.now + 1.0)
    return rmf, robot


# ---- LIFT-REPLAYED-1, LIFT-5: by RMF's own rules


@pytest.mark.parametrize("rides_before", [1, 2])
def test_requests_of_an_earlier_ride_release_no_door_while_a_robot_enters(
    rides_before: int,
) -> None:
    """`make soak SEED=7 RMF=kilted` found this case. The network had cut an adapter off for longer than
    a DDS lease, so the supervisor got its retained requests again."""
    rmf, robot = on_its_threshold(rides_before)
    before = list(rmf.story.edges)
    rmf.finds_again(robot)
    rmf.run(rmf.story.now + 5.0)
    assert rmf.story.edges == before
    assert rmf.story.state == "AGV, open at L3, fleet/a to L3"
    rmf.asks(robot, "L1", inside=True)
    rmf.until_done(robot)
    assert rmf.story.state == "AGV, open at L1, fleet/a to L1"


def test_after_a_supervisor_restart_requests_of_an_earlier_ride_release_no_door() -> None:
    rmf, robot = on_its_threshold(1)
    before = list(rmf.story.edges)
    rmf.supervisor = type(rmf.supervisor)()
    rmf.finds_again(robot)
    rmf.run(rmf.story.now + 5.0)
    assert rmf.story.edges == before
    assert sessions(rmf.story)[-3:] == [A, "", A]


def test_a_robot_that_was_cut_off_before_its_grant_stays_safe() -> None:
    """`make soak SEED=7 RMF=kilted` found this case after 12.6 h. The network had cut the robot's
    adapter off before the lift was granted to the robot."""
    first, robot = RobotContext(B), RobotContext(A)
    rmf = world(first, robot)
    rmf.rides(robot, "L2", "L1")
    rmf.asks(first, "L1")
    rmf.until_done(first)
    rmf.asks(robot, "L3")
    rmf.run(rmf.story.now + 3.0)
    rmf.robots.remove(robot)
    rmf.releases(first)
    rmf.supervisor.slots["Lift1"] = rmf.asked_by(robot)[-1]
    rmf.story.until(lambda: rmf.story.state == "AGV, open at L3, fleet/a to L3")
    before = list(rmf.story.edges)
    rmf.finds_again(robot)
    rmf.run(rmf.story.now + 1.0)
    assert rmf.story.edges == before


@pytest.mark.parametrize("after_s", [2.8, 3.2], ids=["within the grace", "after it"])
def test_requests_of_an_earlier_ride_show_no_robot_a_released_door_as_open(
    after_s: float,
) -> None:
    """RMF's real supervisor was dead when a robot began its next ride, at the floor where its last ride
    had ended.

    The lift still showed the state of the last ride, so the robot entered. Then the door closed.
    """
    lift = Overheard(Building(LiftSample("L2", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)))
    assert lift.story.state == OPEN_FOR_A
    lift.story.ends(A)
    ended_at = lift.story.now
    lift.adapter(AGV, "L2")
    lift.story.run(ended_at + after_s)
    assert not lift.story.outputs.hold_door
    lift.story.asks(A, "L4")
    lift.story.asks(A, "L2")
    lift.story.until(lambda: lift.story.outputs.hold_door)
    assert [state for _, state in lift.story.states][-4:] == [
        "AGV, open at L2",
        "AGV, moving at L2, fleet/a to L4",
        "AGV, moving at L2, fleet/a to L2",
        OPEN_FOR_A,
    ]


# ---- LIFT-REPLAYED-1, LIFT-REPLAYED-2, LIFT-REPLAYED-3: our rules one by one


def test_a_floor_that_only_the_supervisor_requests_counts_after_three_seconds() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    began = lift.story.now
    while lift.story.outputs.hold_door and lift.story.now < began + 2 * LASTS_S:
        lift.story.asks(A, "L4")
        lift.story.run(lift.story.now + 0.25)
    assert began + LASTS_S <= lift.story.now <= began + LASTS_S + 0.5
    assert lift.story.state == "AGV, moving at L2, fleet/a to L4"


def test_a_doubt_lasts_exactly_three_seconds() -> None:
    doubted = Doubted("L4", 10.0)
    session = LiftSession(A, True, "L2", 0.0, doubted=doubted)
    request = LiftRequested(A, True, "L4")
    lasts = [doubt(session, request, "L2", True, now) for now in (12.9, 13.0)]
    assert lasts == [doubted, None]


def test_a_request_for_the_present_floor_ends_the_doubt_and_a_new_one_begins_afterwards() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    lift.story.asks(A, "L4")
    lift.story.run(lift.story.now + LASTS_S)
    lift.story.asks(A, "L2")
    lift.story.asks(A, "L4")
    assert lift.story.state == OPEN_FOR_A
    assert ons(lift.story, "hold_door") == 1


def test_the_own_request_of_the_robot_ends_the_doubt_in_any_order_of_arrival() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    lift.story.asks(A, "L4")
    lift.story.run(lift.story.now + 0.2)
    assert lift.story.state == OPEN_FOR_A
    lift.adapter(AGV, "L4")
    assert lift.story.state == "AGV, moving at L2, fleet/a to L4"


def test_the_own_request_of_the_robot_has_no_effect_before_the_supervisor_passes_it_on() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    lift.adapter(AGV, "L4")
    assert lift.story.state == OPEN_FOR_A
    lift.story.asks(A, "L4")
    lift.story.run(lift.story.now + 0.2)
    assert lift.story.state == "AGV, moving at L2, fleet/a to L4"


def test_a_robot_that_has_ended_or_was_never_heard_raises_no_doubt() -> None:
    for last_said in ((), (AGV, END)):
        lift = Overheard()
        for kind in last_said:
            lift.adapter(kind, "L2" if kind == AGV else "")
        lift.story.asks(A, "L4")
        lift.story.run(lift.story.now + 0.2)
        assert lift.story.state == "AGV, moving at L2, fleet/a to L4"


def test_among_very_many_robots_those_heard_first_are_forgotten() -> None:
    own: Mapping[str, str] = {}
    for number in range(MOST + 1):
        own = noted(own, LiftRequested(f"robot{number}", True, "L1"))
    own = noted(noted(own, LiftRequested("robot1", True, "L2")), EndRequested("robot2"))
    assert list(own) == [*(f"robot{n}" for n in range(3, MOST + 1)), "robot1"]
    assert own["robot1"] == "L2"
