"""Rare cases of RMF's rules: the older rules of Jazzy, and rules that mutation testing found
untested."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages.stamps import stamp
from tests.workbench.rmf_model.test_rmf_rules import (
    AGV,
    ARRIVED,
    BOUND,
    CLOSED,
    END,
    IDLE,
    OPENED,
    A,
    B,
    adapter_door,
    adapter_lift,
    door,
    heard,
    lift,
    listing,
)
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import LiftDestination, RobotContext
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

OTHER_LIFT = replace(IDLE, lift_name="Lift2")

# ---- Jazzy


def test_jazzys_adapter_sends_end_at_once_with_the_floor_and_later_without_one() -> None:
    robot = RobotContext(A, jazzy=True)
    assert robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0) == [adapter_lift(AGV, 1.0)]
    end_at_l3 = replace(END, destination_floor="L3")
    assert robot.begin(EndLiftSession("Lift1"), 2.0) == [adapter_lift(end_at_l3)]
    assert robot.hear(BOUND, 3.0) == [adapter_lift(END)]
    assert robot.begin(EndLiftSession("Lift1"), 4.0) == []


def test_jazzys_adapter_repeats_its_request_at_every_lifts_state() -> None:
    for jazzy, said in ((True, [adapter_lift(AGV, 2.0)]), (False, [])):
        robot = RobotContext(A, jazzy)
        robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0)
        assert robot.hear(OTHER_LIFT, 2.0) == said


def test_jazzys_adapter_releases_a_cancelled_request_from_outside_at_the_next_state() -> None:
    robot = RobotContext(A, jazzy=True)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0)
    robot.phase = None
    assert robot.hear(OTHER_LIFT, 2.0) == [adapter_lift(replace(END, destination_floor="L3"))]
    assert robot.destination is None
    inside = RobotContext(A, jazzy=True)
    inside.begin(RequestLift("Lift1", "L3", inside=True), 1.0)
    inside.phase, inside.on_task = None, False
    assert inside.hear(OTHER_LIFT, 2.0) == [adapter_lift(AGV, 2.0)]
    assert inside.hear(OTHER_LIFT, 3.0) == [adapter_lift(replace(END, destination_floor="L3"))]


def test_jazzys_supervisor_passes_an_adopted_request_on_with_the_adapters_stamp() -> None:
    asked = replace(AGV, request_time=stamp(1.0))
    jazzy = LiftSupervisor(jazzy=True)
    assert heard(jazzy, asked, asked, now=5.0) == [lift(asked, 1.0), lift(asked, 5.0)]
    ended = replace(END, request_time=stamp(1.0))
    assert heard(LiftSupervisor(jazzy=True), ended, now=5.0) == [lift(ended, 1.0)]
    assert heard(LiftSupervisor(), asked, now=5.0) == [lift(asked, 5.0)]


# ---- a lift that has arrived


def test_a_lift_that_has_come_is_taken_as_if_from_inside() -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0)
    robot.hear(ARRIVED, 2.0)
    again = RequestLift("Lift1", "L3", inside=False)
    assert robot.begin(again, 3.0) == [adapter_lift(AGV, 3.0)]
    assert (again.done, robot.destination) == (True, LiftDestination("Lift1", "L3", True))


def test_a_lift_has_come_for_one_destination_and_until_it_is_released() -> None:
    def waits(lift_name: str, floor: str, *, released: bool = False, came: bool = True) -> bool:
        robot = RobotContext(A)
        robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0)
        if came:
            robot.hear(ARRIVED, 2.0)
        if released:
            robot.begin(EndLiftSession("Lift1"), 3.0)
        robot.begin(RequestLift(lift_name, floor, inside=False), 4.0)
        return not robot.done

    assert not waits("Lift1", "L3")
    assert waits("Lift1", "L2")
    assert waits("Lift2", "L3")
    assert waits("Lift1", "L3", released=True)
    assert waits("Lift1", "L3", came=False)


def test_a_new_destination_has_not_come_and_the_same_one_still_has() -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0)
    robot.hear(ARRIVED, 2.0)
    for floor, arrived in (("L3", True), ("L2", False)):
        robot.begin(RequestLift("Lift1", floor, inside=True), 3.0)
        assert robot.has_lift_arrived("Lift1", floor) is arrived


def test_an_end_of_session_waits_for_the_state_of_its_own_lift() -> None:
    robot = RobotContext(A)
    robot.begin(EndLiftSession("Lift1"), 1.0)
    done = []
    for state in (OTHER_LIFT, BOUND, IDLE):
        robot.hear(state, 2.0)
        done.append(robot.done)
    assert done == [False, False, True]


# ---- doors


def test_a_robot_that_lets_one_door_go_still_holds_the_other() -> None:
    robot = RobotContext(A)
    for held, left in (("ward", None), ("lab", "lab")):
        robot.begin(DoorOpen(held), 1.0)
        robot.begin(DoorClose("ward"), 2.0)
        assert robot.holding_door == left


def test_a_robot_that_never_had_a_task_closes_what_it_is_listed_for() -> None:
    robot = RobotContext(A)
    robot.on_task = False
    assert robot.hear(listing(A), 3.0) == [adapter_door(A, CLOSED, 3.0)]


def test_a_door_is_asked_to_close_every_second_until_we_are_not_listed_for_it() -> None:
    robot = RobotContext(A)
    assert robot.begin(DoorClose("ward"), 1.0) == [adapter_door(A, CLOSED, 1.0)]
    assert robot.wake_at() == 2.0
    assert robot.tick(2.0) == [adapter_door(A, CLOSED, 2.0)]
    assert robot.wake_at() == 3.0
    done = []
    for heartbeat in (listing(A, B), listing(B)):
        robot.hear(heartbeat, 2.5)
        done.append(robot.done)
    assert done == [False, True]


def test_a_session_is_as_old_as_its_newest_open_and_a_close_of_that_very_time_ends_it() -> None:
    def ward(who: str, mode: d.DoorModeValue, at: float) -> d.DoorRequest:
        _, request = adapter_door(who, mode, at)
        assert isinstance(request, d.DoorRequest)
        return request

    supervisor = DoorSupervisor()
    heard(supervisor, ward(A, OPENED, 5.0), ward(A, OPENED, 3.0))
    assert supervisor.sessions == {"ward": {A: stamp(5.0)}}
    heard(supervisor, ward(A, CLOSED, 4.0))
    assert supervisor.sessions == {"ward": {A: stamp(5.0)}}
    assert door(CLOSED, 9.0) in heard(supervisor, ward(A, CLOSED, 5.0), now=9.0)
    assert supervisor.sessions == {"ward": {}}
