"""LIFT-1, LIFT-2: the node works with stand-ins for RMF's lift supervisor and fleet adapters. Messages
get lost, and the stand-ins and the node restart."""

import pytest

from bridges.kinds.lift.signals import Hazard, LiftOutputs
from bridges.messages.definitions import LiftRequest, Time
from tests.kinds.lift.rmf_world import World
from tests.kinds.lift.story import AGV, END, Controller, Story
from workbench.rmf_model.robot import RobotContext

A, B = "fleet/a", "fleet/b"


def world(*robots: RobotContext, adapters_first: bool = False) -> World:
    started = World(Story(Controller()), *robots, adapters_first=adapters_first)
    started.run(1.0)
    return started


def ons(story: Story, output: str) -> int:
    """Return the number of times that an output was switched on."""
    return sum(1 for _, name, value in story.edges if name == output and value)


def sessions(story: Story) -> list[str]:
    """Return the sessions that the lift has shown, in order. "" means no session."""
    shown = [state.session_id for _, state in story.told]
    return [s for s, before in zip(shown, [None, *shown], strict=False) if s != before]


@pytest.mark.parametrize("adapters_first", [False, True])
def test_a_whole_ride_completes_without_a_surplus_relay_edge(adapters_first: bool) -> None:
    robot = RobotContext(A)
    rmf = world(robot, adapters_first=adapters_first)
    rmf.rides(robot, "L3", "L1")
    rmf.run(rmf.story.now + 10.0)
    assert [(name, value) for _, name, value in rmf.story.edges] == [
        ("agv_request", True),
        ("call", "L3"),
        ("call", None),
        ("hold_door", "front"),
        ("hold_door", None),
        ("call", "L1"),
        ("call", None),
        ("hold_door", "front"),
        ("hold_door", None),
        ("agv_request", False),
    ]
    assert rmf.story.state == "HUMAN, closed at L1"
    assert sessions(rmf.story) == ["", A, ""]


def test_a_hundred_requests_a_second_cause_no_additional_state() -> None:
    quiet, loud = Story(Controller()), Story(Controller())
    for story in (quiet, loud):
        story.run(1.0)
        story.asks(A, "L3")
        story.run(20.0)
        for _ in range(500):
            if story is loud:
                story.asks(A, "L3")
            story.run(story.now + 0.01)
    assert len(loud.told) == len(quiet.told)


@pytest.mark.parametrize("adapters_first", [False, True])
def test_a_waiting_robot_is_served_after_the_robot_that_rides(adapters_first: bool) -> None:
    a, b = RobotContext(A), RobotContext(B)
    rmf = world(a, b, adapters_first=adapters_first)
    rmf.asks(a, "L2")
    rmf.until_done(a)
    rmf.asks(b, "L1")
    rmf.run(rmf.story.now + 20.0)
    assert sessions(rmf.story) == ["", A]
    released_at = rmf.story.now
    rmf.releases(a)
    rmf.until_done(b)
    assert sessions(rmf.story) == ["", A, "", B]
    granted_at = next(at for at, state in rmf.story.told if state.session_id == B)
    states_of_nobody = [s for at, s in rmf.story.told if released_at < at and not s.session_id]
    # this time has the next state, then 3 s of grace, then B's next request
    assert granted_at - released_at < 5.0
    assert len(states_of_nobody) <= 5


@pytest.mark.parametrize("adapters_first", [False, True])
def test_without_grace_the_next_robot_gets_the_lift_within_three_states(
    adapters_first: bool,
) -> None:
    a, b = RobotContext(A), RobotContext(B)
    rmf = World(Story(Controller(), release_grace_s=0), a, b, adapters_first=adapters_first)
    rmf.run(1.0)
    rmf.asks(a, "L2")
    rmf.until_done(a)
    rmf.asks(b, "L1")
    rmf.run(rmf.story.now + 20.0)
    states_before = len(rmf.story.told)
    rmf.releases(a)
    rmf.until_done(b)
    first_of_b = next(i for i, (_, s) in enumerate(rmf.story.told) if s.session_id == B)
    assert first_of_b - states_before < 3 + 1


@pytest.mark.parametrize("times", [1, 10])
def test_a_lost_end_is_repeated_until_the_node_hears_it(times: int) -> None:
    robot = RobotContext(A)
    rmf = world(robot)
    rmf.asks(robot, "L2")
    rmf.until_done(robot)
    lost: list[LiftRequest] = []

    def fate(request: LiftRequest) -> tuple[float, ...]:
        if request.request_type == END and len(lost) < times:
            lost.append(request)
            return ()
        return (0.0,)

    rmf.fate = fate
    rmf.releases(robot)
    rmf.until_done(robot)
    rmf.run(rmf.story.now + 5.0)
    assert len(lost) == times
    assert sessions(rmf.story) == ["", A, ""]
    assert rmf.story.outputs == LiftOutputs()


@pytest.mark.parametrize("adapters_first", [False, True])
def test_a_supervisor_that_restarts_with_a_robot_in_the_car_does_not_end_its_session(
    adapters_first: bool,
) -> None:
    robot = RobotContext(A)
    rmf = world(robot, adapters_first=adapters_first)
    rmf.asks(robot, "L2")
    rmf.until_done(robot)
    robot.in_car = True
    rmf.run(rmf.story.now + 3.0)
    edges = list(rmf.story.edges)
    rmf.supervisor.slots.clear()  # after its restart the supervisor hears a state first
    rmf.run(rmf.story.now + 20.0)
    ends = [request for request in rmf.requested if request.request_type == END]
    assert len(ends) == 1
    assert rmf.story.edges == edges
    assert sessions(rmf.story) == ["", A]
    assert rmf.story.state == "AGV, open at L2, fleet/a to L2"
    rmf.asks(robot, "L4", inside=True)
    rmf.until_done(robot)


def test_a_supervisor_restart_during_a_ride_repeats_one_call_and_keeps_agv_mode() -> None:
    robot = RobotContext(A)
    rmf = world(robot)
    rmf.asks(robot, "L4")
    rmf.run(4.0)
    rmf.supervisor.slots.clear()
    rmf.until_done(robot)
    assert ons(rmf.story, "agv_request") == 1
    assert ons(rmf.story, "call") == 2
    assert ons(rmf.story, "hold_door") == 1


def test_a_supervisor_that_restarts_in_a_fire_does_not_lock_the_robot_in() -> None:
    robot = RobotContext(A)
    rmf = world(robot)
    rmf.asks(robot, "L2")
    rmf.until_done(robot)
    robot.in_car = True
    rmf.run(rmf.story.now + 3.0)
    rmf.story.building.hazard(Hazard.FIRE)
    rmf.run(rmf.story.now + 3.0)
    rmf.supervisor.slots.clear()
    rmf.run(rmf.story.now + 3.0)
    assert [r.request_type for r in rmf.requested].count(END) == 1
    assert rmf.story.state.startswith("FIRE")
    assert rmf.story.state.endswith(", fleet/a to L2")
    assert rmf.story.outputs == LiftOutputs()


def test_the_replay_of_a_hundred_old_requests_switches_agv_mode_once() -> None:
    """RMF's fleet adapters retain their requests. A supervisor that starts gets a hundred old
    requests."""
    story = Story(Controller())
    story.run(1.0)
    old = [
        LiftRequest("Lift1", Time(), (A, B)[i // 10 % 2], int(END if i % 10 == 9 else AGV),
                    f"L{i % 4 + 1}", 2)
        for i in range(99)
    ]  # fmt: skip
    for i, request in enumerate([*old, LiftRequest("Lift1", Time(), A, int(AGV), "L3", 2)]):
        story.run(1.0 + i * 0.008)
        story.request(request)
    assert ons(story, "agv_request") == 1
    assert ons(story, "call") == 0
    story.run(20.0)
    story.asks(A, "L3")
    story.run(40.0)
    assert story.state == "AGV, open at L3, fleet/a to L3"
    assert ons(story, "agv_request") <= 2


def test_a_fleet_adapter_that_restarts_ends_the_session_that_it_no_longer_wants() -> None:
    robot = RobotContext(A)
    rmf = world(robot)
    rmf.asks(robot, "L3")
    rmf.run(10.0)
    rmf.restart_adapter(robot)
    rmf.run(20.0)
    assert sessions(rmf.story) == ["", A, ""]
    assert rmf.story.outputs == LiftOutputs()


def test_a_restarted_node_starts_with_outputs_off_and_grants_the_next_request() -> None:
    robot = RobotContext(A)
    rmf = world(robot)
    rmf.asks(robot, "L3")
    rmf.run(4.0)
    rmf.story.node.close()
    told = len(rmf.story.told)
    rmf.story.restart()
    rmf.until_done(robot)
    after = [state for _, state in rmf.story.told[told:]]
    assert (after[0].current_mode, after[0].session_id, after[0].current_floor) == (4, "", "")
    assert (4.0, "call", None) in rmf.story.edges
    assert (4.0, "agv_request", False) in rmf.story.edges
    assert sessions(rmf.story) == ["", A, "", A]


def test_a_robot_rides_again_and_again_while_supervisor_and_node_restart() -> None:
    robot = RobotContext(A)
    rmf = world(robot)
    for ride in range(6):
        rmf.asks(robot, "L3")
        rmf.run(rmf.story.now + ride)
        rmf.restart_supervisor()
        rmf.run(rmf.story.now + 0.7)
        rmf.story.restart()
        rmf.until_done(robot)
        rmf.asks(robot, "L1", inside=True)
        rmf.until_done(robot)
        rmf.releases(robot)
        rmf.until_done(robot)
        rmf.run(rmf.story.now + 5.0)
        assert rmf.story.outputs == LiftOutputs()
