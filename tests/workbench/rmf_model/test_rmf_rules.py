"""The rules of RMF's supervisors and fleet adapters in our model. Each test checks one rule."""

from collections.abc import Iterable

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from workbench.rmf_model import NEVER, Party, Said, door_request
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import RobotContext
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

A, B = "fleet/a", "fleet/b"
AGV = d.LiftRequest("Lift1", d.Time(), A, 1, "L3", 2)
END = d.LiftRequest("Lift1", d.Time(), A, 0, "", 0)
IDLE = d.LiftState(lift_name="Lift1", current_floor="L1")
BOUND = replace(IDLE, session_id=A, destination_floor="L3", door_state=0)
ARRIVED = replace(IDLE, session_id=A, current_floor="L3", door_state=2)
OPENED, CLOSED, MOVING = (d.DoorModeValue(n) for n in (2, 0, 1))


def lift(request: d.LiftRequest, now: float = 0.0) -> Said:
    return topics.LIFT_REQUESTS, replace(request, request_time=stamp(now))


def adapter_lift(request: d.LiftRequest, now: float = 0.0) -> Said:
    return topics.ADAPTER_LIFT_REQUESTS, replace(request, request_time=stamp(now))


def door(mode: d.DoorModeValue, now: float = 0.0) -> Said:
    return topics.DOOR_REQUESTS, door_request("ward", "door_supervisor", mode, now)


def adapter_door(who: str, mode: d.DoorModeValue, now: float = 0.0) -> Said:
    return topics.ADAPTER_DOOR_REQUESTS, door_request("ward", who, mode, now)


def door_state(mode: d.DoorModeValue | int, name: str = "ward") -> d.DoorState:
    return d.DoorState(door_name=name, current_mode=d.DoorMode(int(mode)))


def listing(*requesters: str, at: float = 0.0) -> d.SupervisorHeartbeat:
    sessions = tuple(d.Session(stamp(at), requester) for requester in requesters)
    return d.SupervisorHeartbeat((d.DoorSessions("ward", sessions),))


def heard(party: Party, *messages: d.Message, now: float = 0.0) -> list[Said]:
    """Return the messages that a party sends in answer to these messages."""
    return [said for message in messages for said in party.hear(message, now)]


def circulate(parties: Iterable[Party], said: list[Said], now: float) -> list[Said]:
    """Deliver messages until no party answers any more. Return all messages in order."""
    parties, record, left = list(parties), list[Said](), list(said)
    while left:
        topic, message = left.pop(0)
        record.append((topic, message))
        assert len(record) < 1000, "the parties send messages without end"
        for party in parties:
            if topic in party.subscribes:
                left += party.hear(message, now)
    return record


# --- the lift supervisor -----------------------------------------------------------------------


def test_a_first_request_is_adopted_stamped_and_published() -> None:
    supervisor = LiftSupervisor()
    assert heard(supervisor, AGV, now=5.0) == [lift(AGV, 5.0)]
    assert supervisor.slots == {"Lift1": replace(AGV, request_time=stamp(5.0))}


def test_each_request_of_the_holder_is_published_without_a_limit() -> None:
    again = replace(AGV, destination_floor="L2")
    assert heard(LiftSupervisor(), AGV, AGV, again) == [lift(AGV), lift(AGV), lift(again)]


def test_the_holders_end_is_forwarded_with_its_empty_floor_and_frees_the_slot() -> None:
    supervisor = LiftSupervisor()
    assert heard(supervisor, AGV, END) == [lift(AGV), lift(END)]
    assert supervisor.slots == {}


def test_an_end_without_a_holder_is_ignored() -> None:
    assert heard(LiftSupervisor(), END) == []


def test_another_session_is_dropped_silently_whatever_it_wants() -> None:
    other = replace(AGV, session_id=B)
    assert heard(LiftSupervisor(), AGV, other, replace(END, session_id=B)) == [lift(AGV)]
    assert heard(LiftSupervisor(), AGV, END, other) == [lift(AGV), lift(END), lift(other)]


@pytest.mark.parametrize(
    ("state", "repeats"),
    [
        (BOUND, True),  # the door is not open
        (replace(BOUND, door_state=2), False),
        (ARRIVED, False),
        (replace(ARRIVED, session_id=""), True),
        (replace(ARRIVED, session_id=B), True),
        (replace(ARRIVED, destination_floor="L1"), True),
        (replace(ARRIVED, current_floor="L1"), True),
        (replace(ARRIVED, current_mode=d.LiftMode.MODE_FIRE), False),
    ],
)
def test_a_state_that_differs_from_the_slot_is_answered_with_the_request_again(
    state: d.LiftState, repeats: bool
) -> None:
    supervisor = LiftSupervisor()
    heard(supervisor, AGV)
    assert heard(supervisor, state, now=7.0) == ([lift(AGV, 7.0)] if repeats else [])


def test_a_restarted_supervisor_ends_the_session_of_a_robot_in_the_car() -> None:
    end = replace(END, destination_floor="L3")
    assert heard(LiftSupervisor(), ARRIVED, now=9.0) == [lift(end, 9.0)]
    assert heard(LiftSupervisor(), IDLE) == []


# --- the door supervisor -----------------------------------------------------------------------


def test_each_open_is_forwarded_under_the_supervisors_name_and_the_heartbeat_goes_out() -> None:
    supervisor = DoorSupervisor()
    request = door_request("ward", A, OPENED, 3.0)
    assert heard(supervisor, request, now=4.0) == [
        door(OPENED, 4.0),
        (topics.DOOR_SUPERVISOR_HEARTBEAT, listing(A, at=3.0)),
    ]


def test_the_door_is_closed_only_by_the_last_of_those_who_wanted_it_open() -> None:
    supervisor = DoorSupervisor()
    heard(supervisor, door_request("ward", A, OPENED, 1), door_request("ward", B, OPENED, 1))
    assert heard(supervisor, door_request("ward", A, CLOSED, 2)) == [
        (topics.DOOR_SUPERVISOR_HEARTBEAT, listing(B, at=1))
    ]
    assert heard(supervisor, door_request("ward", B, CLOSED, 2)) == [
        door(CLOSED),
        (topics.DOOR_SUPERVISOR_HEARTBEAT, listing()),
    ]


def test_a_close_of_a_stranger_or_older_than_the_open_only_causes_a_heartbeat() -> None:
    supervisor = DoorSupervisor()
    stranger = heard(supervisor, door_request("ward", B, CLOSED, 1))
    assert stranger == [(topics.DOOR_SUPERVISOR_HEARTBEAT, d.SupervisorHeartbeat())]
    heard(supervisor, door_request("ward", A, OPENED, 5))
    late = heard(supervisor, door_request("ward", A, CLOSED, 4))
    assert late == [(topics.DOOR_SUPERVISOR_HEARTBEAT, listing(A, at=5))]


@pytest.mark.parametrize(
    ("mode", "unwanted", "wanted"),
    [(OPENED, CLOSED, None), (MOVING, CLOSED, OPENED), (CLOSED, None, OPENED), (3, None, None)],
)
def test_states_cause_reminders_but_those_of_an_offline_door_do_not(
    mode: d.DoorModeValue, unwanted: d.DoorModeValue | None, wanted: d.DoorModeValue | None
) -> None:
    supervisor = DoorSupervisor()
    assert heard(supervisor, door_state(mode)) == ([] if unwanted is None else [door(unwanted)])
    heard(supervisor, door_request("ward", A, OPENED, 0))
    assert heard(supervisor, door_state(mode)) == ([] if wanted is None else [door(wanted)])


def test_a_request_for_moving_is_ignored() -> None:
    assert heard(DoorSupervisor(), door_request("ward", A, MOVING, 0)) == []


# --- a fleet adapter and its lift --------------------------------------------------------------


def test_a_lift_is_requested_at_once_and_again_at_each_of_its_states() -> None:
    robot = RobotContext(A)
    assert robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0) == [adapter_lift(AGV, 1.0)]
    assert heard(robot, IDLE, now=2.0) == [adapter_lift(AGV, 2.0)]
    assert heard(robot, replace(IDLE, lift_name="Lift2")) == []
    assert robot.wake_at() == NEVER


@pytest.mark.parametrize(
    "nearly",
    [
        replace(ARRIVED, session_id=""),
        replace(ARRIVED, current_floor="L2"),
        replace(ARRIVED, door_state=1),
        replace(ARRIVED, lift_name="Lift2"),
    ],
)
def test_a_lift_has_come_when_floor_door_and_session_are_right_whatever_the_mode(
    nearly: d.LiftState,
) -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=True), 0.0)
    heard(robot, nearly)
    assert not robot.done
    heard(robot, replace(ARRIVED, current_mode=d.LiftMode.MODE_FIRE))
    assert robot.done


def test_once_it_has_come_the_robot_asks_for_the_same_floor_again_as_if_from_inside() -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 0.0)
    assert heard(robot, ARRIVED) == [adapter_lift(AGV), adapter_lift(AGV)]
    assert robot.destination is not None
    assert robot.destination.inside


def test_a_lift_that_has_already_come_is_not_waited_for_again() -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 0.0)
    heard(robot, ARRIVED)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 1.0)
    assert robot.done


def test_end_is_sent_while_states_show_our_session_and_not_before_or_after() -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=True), 0.0)
    assert robot.begin(EndLiftSession("Lift1"), 1.0) == []
    assert heard(robot, ARRIVED, ARRIVED, now=2.0) == [adapter_lift(END, 2.0)] * 2
    assert not robot.done
    assert heard(robot, IDLE) == []
    assert robot.done


def test_a_restarted_fleet_adapter_ends_a_session_that_it_knows_nothing_of() -> None:
    assert heard(RobotContext(A), ARRIVED) == [adapter_lift(END)]
    assert heard(RobotContext(B), ARRIVED) == []


def test_a_cancelled_request_from_outside_is_released_after_30_s() -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=False), 0.0)
    heard(robot, IDLE, now=100.0)
    robot.phase = None
    heard(robot, IDLE, now=101.0)
    heard(robot, IDLE, now=131.0)
    assert robot.destination is not None
    assert heard(robot, ARRIVED, now=131.5) == [adapter_lift(END, 131.5)]


@pytest.mark.parametrize(("on_task", "in_car"), [(True, False), (False, True)])
def test_a_lift_asked_for_from_inside_is_kept_while_on_a_task_or_in_the_car(
    on_task: bool, in_car: bool
) -> None:
    robot = RobotContext(A)
    robot.begin(RequestLift("Lift1", "L3", inside=True), 0.0)
    heard(robot, ARRIVED)
    robot.on_task, robot.in_car = on_task, in_car
    heard(robot, ARRIVED, now=1.0)
    heard(robot, ARRIVED, now=100.0)
    assert robot.destination is not None
    robot.on_task, robot.in_car = False, False
    heard(robot, ARRIVED, now=101.0)
    heard(robot, ARRIVED, now=111.5)
    assert robot.destination is None


# --- a fleet adapter and its door --------------------------------------------------------------


def test_a_door_is_asked_to_open_every_second_until_open_and_listed() -> None:
    robot = RobotContext(A)
    assert robot.begin(DoorOpen("ward"), 0.0) == [adapter_door(A, OPENED)]
    assert robot.wake_at() == 1.0
    assert robot.tick(1.0) == [adapter_door(A, OPENED, 1.0)]
    heard(robot, door_state(OPENED), listing(B))
    assert not robot.done
    heard(robot, listing(A))
    assert robot.done
    assert (robot.tick(2.0), robot.wake_at()) == ([], NEVER)


def test_the_latest_state_of_another_door_keeps_a_door_open_phase_waiting() -> None:
    robot = RobotContext(A)
    robot.begin(DoorOpen("ward"), 0.0)
    heard(robot, door_state(OPENED), door_state(OPENED, "other"), listing(A))
    assert not robot.done
    heard(robot, door_state(OPENED))
    assert robot.done


def test_a_door_close_waits_for_the_heartbeat_and_not_for_the_door() -> None:
    robot = RobotContext(A)
    assert robot.begin(DoorClose("ward"), 0.0) == [adapter_door(A, CLOSED)]
    assert robot.tick(1.0) == [adapter_door(A, CLOSED, 1.0)]
    heard(robot, door_state(CLOSED), door_state(OPENED))
    assert not robot.done
    heard(robot, listing(B))
    assert robot.done


def test_a_session_for_a_door_that_we_do_not_hold_is_closed() -> None:
    robot = RobotContext(A)
    assert heard(robot, listing(A, B), now=3.0) == [adapter_door(A, CLOSED, 3.0)]
    robot.begin(DoorOpen("ward"), 0.0)
    assert heard(robot, listing(A)) == []
    robot.on_task = False
    assert heard(robot, listing(A), now=10.0) == []
    assert heard(robot, listing(A), now=10.1) == [adapter_door(A, CLOSED, 10.1)]


# --- together ----------------------------------------------------------------------------------


def test_a_waiting_robot_costs_two_requests_for_each_state_and_one_after_arrival() -> None:
    robot = RobotContext(A)
    parties: list[Party] = [LiftSupervisor(), robot]
    circulate(parties, robot.begin(RequestLift("Lift1", "L3", inside=True), 0.0), 0.0)

    def requests_for(state: d.LiftState) -> int:
        record = circulate(parties, [(topics.LIFT_STATES, state)], 1.0)
        return [topic for topic, _ in record].count(topics.LIFT_REQUESTS)

    assert [requests_for(s) for s in (IDLE, BOUND, BOUND, ARRIVED, ARRIVED)] == [2, 2, 2, 1, 1]


def test_a_node_that_refuses_the_floorless_end_locks_two_robots_out_for_ever() -> None:
    """RMF behaves like this. At A's END the supervisor forgets A and serves B. Then it drops A's
    repeated ENDs."""
    supervisor, a, b = LiftSupervisor(), RobotContext(A), RobotContext(B)
    parties: list[Party] = [supervisor, a, b]
    circulate(parties, a.begin(RequestLift("Lift1", "L3", inside=True), 0.0), 0.0)
    circulate(parties, b.begin(RequestLift("Lift1", "L1", inside=False), 0.0), 0.0)
    circulate(parties, [(topics.LIFT_STATES, ARRIVED)], 1.0)
    a.begin(EndLiftSession("Lift1"), 1.0)
    for second in range(2, 60):
        record = circulate(parties, [(topics.LIFT_STATES, ARRIVED)], float(second))
    reaches_node = {
        message.session_id
        for topic, message in record
        if topic == topics.LIFT_REQUESTS and isinstance(message, d.LiftRequest)
    }
    assert reaches_node == {B}
    assert not a.done


def test_a_robot_opens_a_door_and_lets_it_go_through_the_supervisor() -> None:
    supervisor, robot = DoorSupervisor(), RobotContext(A)
    parties: list[Party] = [supervisor, robot]
    said = circulate(parties, robot.begin(DoorOpen("ward"), 0.0), 0.0)
    assert door(OPENED) in said
    assert not robot.done
    circulate(parties, [(topics.DOOR_STATES, door_state(OPENED))], 1.0)
    assert robot.done
    said = circulate(parties, robot.begin(DoorClose("ward"), 2.0), 2.0)
    assert door(CLOSED, 2.0) in said
    assert robot.done
