"""Rides of robots through our lift supervisor, with RMF's fleet adapters and our lift node. Messages
get lost, and the nodes restart."""

from collections import deque
from collections.abc import Sequence
from itertools import pairwise

import pytest
from msgspec.structs import replace

from bridges.kinds.lift.signals import Hazard
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.messages.definitions import LiftRequest
from bridges.messages.stamps import stamp
from bridges.messages.topics import ADAPTER_LIFT_REQUESTS, LIFT_REQUESTS
from tests.kinds.lift_supervisor.world import (
    LiftNode,
    OurSupervisor,
    Rider,
    RmfsSupervisor,
    requests,
    sessions,
)
from tests.runtime.virtual_graph import EPOCH, World
from workbench.graph.requests import RequestProgress
from workbench.graph.requests.lift import LiftEnd

A, B, C = "fleet/a", "fleet/b", "fleet/c"
UP, DOWN = ("L1", "L3"), ("L3", "L1")


@pytest.mark.parametrize("away_s", [50.0, 75.0])
def test_rides_that_are_over_move_nothing_when_the_supervisors_network_comes_back(
    away_s: float,
) -> None:
    """After 60 s the supervisor has forgotten the lift. Then the adapter's retained requests come."""
    away = [False]

    def route(sender: str, receiver: str) -> Sequence[float]:
        return () if away[0] and "supervisor" in (sender, receiver) else (0.01,)

    world = World(route)
    supervisor, _ = OurSupervisor(world), LiftNode(world)
    rider = Rider(world, A, UP, DOWN)
    world.run(300.0, lambda: rider.done)
    world.run(world.now + 10.0)
    before = requests(world)
    away[0] = True
    world.run(world.now + away_s)
    away[0] = False
    world.replay("supervisor")
    world.run(world.now + 20.0)
    assert requests(world) == before
    assert supervisor.node.refused != {}


def adapters_first(sender: str, receiver: str) -> Sequence[float]:
    return (0.02,) if receiver == "supervisor" else (0.01,)


def supervisor_first(sender: str, receiver: str) -> Sequence[float]:
    return (0.01,) if receiver == "supervisor" else (0.02,)


def changes(world: World) -> list[str]:
    """Return the messages to the lift's node, without repeats."""
    said = [text for _, text in requests(world)]
    return [text for text, before in zip(said, ["", *said], strict=False) if text != before]


def shown(world: World) -> list[str]:
    """Return the sessions that the lift has shown, in order."""
    return [session for _, session in sessions(world)]


def lines(lift: LiftNode) -> list[tuple[str, object]]:
    """Return (output, value) of each change of the lift's outputs."""
    return [(signal, value) for _, signal, value in lift.lift.edges]


RIDE_UP: list[tuple[str, object]] = [
    ("agv_request", True),
    ("hold_door", "front"),
    ("hold_door", None),
    ("call", "L3"),
    ("call", None),
    ("hold_door", "front"),
    ("hold_door", None),
    ("agv_request", False),
]


@pytest.mark.parametrize("route", [adapters_first, supervisor_first])
def test_a_ride_is_one_session_two_calls_for_the_car_and_one_release(route: object) -> None:
    world = World(route)  # type: ignore[arg-type]
    OurSupervisor(world)
    lift, robot = LiftNode(world), Rider(world, A, UP)
    world.run(60.0)
    assert changes(world) == ["AGV fleet/a L1", "AGV fleet/a L3", "END fleet/a L3"]
    assert shown(world) == [A, ""]
    assert lines(lift) == RIDE_UP
    assert robot.done


@pytest.mark.parametrize("route", [adapters_first, supervisor_first])
def test_a_second_robot_is_served_as_soon_as_the_first_has_released(route: object) -> None:
    world = World(route)  # type: ignore[arg-type]
    OurSupervisor(world)
    LiftNode(world)
    robots = [Rider(world, A, UP), Rider(world, B, DOWN, starts_at=8.0)]
    world.run(120.0, lambda: all(robot.done for robot in robots))
    assert shown(world) == [A, "", B, ""]
    assert changes(world) == [
        "AGV fleet/a L1",
        "AGV fleet/a L3",
        "END fleet/a L3",
        "AGV fleet/b L3",
        "AGV fleet/b L1",
        "END fleet/b L1",
    ]
    ended_at = next(at for at, text in requests(world) if text == "END fleet/a L3")
    passed_on_at = next(at for at, text in requests(world) if text == "AGV fleet/b L3")
    # B's turn begins with the next state, which comes within 1 s
    assert passed_on_at - ended_at < 1.1


@pytest.mark.parametrize("lost", [1, 10])
def test_lost_ends_are_repeated_until_one_is_obeyed(lost: int) -> None:
    world = World()
    left = {"supervisor": lost, "Lift1": lost}

    def route(sender: str, receiver: str) -> Sequence[float]:
        message = world.sent[-1][3]
        ends = isinstance(message, LiftRequest) and message.request_type == 0
        if ends and left[receiver]:
            left[receiver] -= 1
            return ()
        return (0.01,)

    world.route = route
    OurSupervisor(world)
    LiftNode(world)
    robots = [Rider(world, A, UP), Rider(world, B, DOWN, starts_at=8.0)]
    world.run(180.0, lambda: all(robot.done for robot in robots))
    assert shown(world) == [A, "", B, ""]
    ends = [at for at, text in requests(world) if text.startswith("END fleet/a")]
    assert len(ends) == lost + 1
    assert all(0.99 < later - at < 1.1 for at, later in pairwise(ends))
    assert all(robot.done for robot in robots)


def test_robots_that_wait_move_no_relay() -> None:
    def edges(*others: str) -> list[tuple[float, str, object]]:
        world = World()
        OurSupervisor(world)
        lift = LiftNode(world)
        Rider(world, A, UP)
        for number, name in enumerate(others):
            Rider(world, name, DOWN, starts_at=6.0 + number)
        world.run(120.0, lambda: shown(world)[1:] == [""])
        return lift.lift.edges

    assert edges(B, C) == edges()


def test_a_queue_is_served_in_order_without_robots_that_fell_silent() -> None:
    world = World()
    OurSupervisor(world)
    LiftNode(world)
    names = [A, B, C, "fleet/d"]
    robots = [Rider(world, n, UP, starts_at=5.0 + i) for i, n in enumerate(names)]
    world.run(10.0)
    robots[1].die()
    world.run(300.0)
    assert shown(world) == [A, "", C, "", "fleet/d", ""]


# ---- LIFT-SUPERVISOR-6: restarts


def test_a_lift_node_that_restarts_in_mid_ride_gets_the_session_again_and_the_ride_ends() -> None:
    world = World()
    OurSupervisor(world)
    lift, robot = LiftNode(world), Rider(world, A, UP)
    world.run(13.0)
    lift.restart()
    world.run(60.0)
    assert shown(world) == [A, "", A, ""]
    assert changes(world) == ["AGV fleet/a L1", "AGV fleet/a L3", "END fleet/a L3"]
    assert robot.done


@pytest.mark.parametrize("skew", [0.0, -3600.0, 3600.0])
@pytest.mark.parametrize("our_skew", [0.0, -3600.0, 3600.0])
def test_a_supervisor_that_restarts_with_a_robot_in_the_car_moves_no_relay(
    skew: float, our_skew: float
) -> None:
    """The clocks of the supervisor and of the adapter may be wrong by an hour. The robot keeps its
    ride."""
    world = World()
    supervisor = OurSupervisor(world, wall_skew=our_skew)
    lift, robot = LiftNode(world), Rider(world, A, UP, skew=skew)
    for restart_at in (9.0, 12.5, 16.0, 20.0):
        world.run(restart_at)
        supervisor.restart()
    world.run(60.0)
    assert changes(world) == ["AGV fleet/a L1", "AGV fleet/a L3", "END fleet/a L3"]
    assert shown(world) == [A, ""]
    assert lines(lift) == RIDE_UP
    assert robot.done


def test_the_supervisor_of_rmf_restarts_in_the_same_way_and_interrupts_the_ride() -> None:
    """After END the lift's node waits for some time (the grace), because RMF's supervisor may send a
    wrong END. Our supervisor needs no grace."""
    world = World()
    supervisor = RmfsSupervisor(world)
    lift, robot = LiftNode(world), Rider(world, A, UP)
    world.run(16.5)
    world.retained.clear()  # as if they reached the new supervisor too late
    supervisor.restart()
    world.run(60.0)
    assert changes(world)[2:4] == ["END fleet/a L3", "AGV fleet/a L3"]
    assert lines(lift) == RIDE_UP
    assert robot.done


def test_a_hundred_old_requests_of_many_sessions_move_nothing_at_a_restart() -> None:
    world = World()
    supervisor = OurSupervisor(world)
    lift = LiftNode(world)
    world.run(2000.0)
    old = [
        LiftRequest(
            "Lift1", stamp(EPOCH + n), f"fleet/{n % 7}", n % 3 and 1, f"L{n % 3 + 1}", n % 3 and 2
        )
        for n in range(1900, 2000)
    ]
    world.retained["fleet"] = deque((ADAPTER_LIFT_REQUESTS, request) for request in old)
    supervisor.restart()
    robot = Rider(world, A, UP, starts_at=2010.0)
    world.run(2100.0)
    assert changes(world) == ["AGV fleet/a L1", "AGV fleet/a L3", "END fleet/a L3"]
    assert lines(lift) == RIDE_UP
    assert robot.done


def test_an_adapter_that_restarts_releases_the_lift_of_its_forgotten_ride() -> None:
    world = World()
    OurSupervisor(world)
    LiftNode(world)
    robots = [Rider(world, A, UP), Rider(world, B, DOWN, starts_at=8.0)]
    world.run(13.0)
    robots[0].restart()
    world.run(300.0, lambda: all(robot.done for robot in robots))
    assert shown(world) == [A, "", B, "", A, ""]


# ---- LIFT-SUPERVISOR-6: another supervisor


def test_ours_is_silent_beside_the_supervisor_of_rmf_and_takes_over_after_it() -> None:
    world = World()
    rmfs = RmfsSupervisor(world)
    ours = OurSupervisor(world)
    lift, robot = LiftNode(world), Rider(world, A, UP)
    world.run(12.5)
    assert {sender for _, sender, topic, _ in world.sent if topic == LIFT_REQUESTS} == {rmfs.name}
    assert ours.node.status()["passive"]
    assert world.publishers[LIFT_REQUESTS.name] == {rmfs.name}
    rmfs.leave()
    world.run(60.0)
    assert changes(world) == ["AGV fleet/a L1", "AGV fleet/a L3", "END fleet/a L3"]
    assert lines(lift) == RIDE_UP
    assert robot.done


def test_a_second_supervisor_of_ours_stands_by_and_takes_over() -> None:
    world = World()
    first = OurSupervisor(world, name="first")
    world.run(4.0)
    second = OurSupervisor(world, name="second")
    robot = Rider(world, A, UP)
    lift = LiftNode(world)
    world.run(12.5)
    assert (first.node.presence.may_speak, second.node.presence.may_speak) == (True, False)
    first.leave()
    world.run(60.0)
    assert second.node.presence.may_speak
    assert lines(lift) == RIDE_UP
    assert robot.done


# ---- LIFT-SUPERVISOR-4, LIFT-SUPERVISOR-5: operators and hazards


def test_an_operator_releases_the_lift_of_a_dead_robot_for_those_who_wait() -> None:
    """An operator sends END with `send lift Lift1 --end`. The operator's clock is a minute behind."""
    world = World()
    OurSupervisor(world)
    LiftNode(world)
    robots = [Rider(world, A, UP), Rider(world, B, DOWN, starts_at=8.0)]
    world.run(14.0)
    robots[0].die()
    world.run(600.0)
    assert shown(world) == [A]
    end = LiftEnd("Lift1", A).message(RequestProgress(0.0, 60.0))
    assert end is not None
    end = replace(end, request_time=stamp(EPOCH + world.now - 60.0))
    world.send("operator", ADAPTER_LIFT_REQUESTS, end)
    world.run(700.0, lambda: robots[1].done)
    assert shown(world) == [A, "", B, ""]


def test_with_the_setting_the_lift_of_a_dead_robot_goes_to_the_next_robot() -> None:
    world = World()
    OurSupervisor(world, LiftSupervisorSettings(holder_ttl_s=90))
    LiftNode(world)
    robots = [Rider(world, A, UP), Rider(world, B, DOWN, starts_at=8.0)]
    world.run(14.0)
    robots[0].die()
    world.run(100.0)
    assert shown(world) == [A]
    world.run(200.0, lambda: robots[1].done)
    assert shown(world) == [A, "", B, ""]


def test_in_a_fire_no_new_request_is_sent_and_the_rides_follow_afterwards() -> None:
    world = World()
    OurSupervisor(world)
    lift = LiftNode(world)
    lift.lift.hazard(Hazard.FIRE)
    robots = [Rider(world, A, UP), Rider(world, B, DOWN, starts_at=8.0)]
    world.run(60.0)
    assert (requests(world), lift.lift.edges) == ([], [])
    lift.lift.hazard()
    world.run(200.0, lambda: all(robot.done for robot in robots))
    assert shown(world) == [A, "", B, ""]
