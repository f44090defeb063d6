"""`send` in virtual time: the requests and their times, the outcome, and the texts for failures."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import msgspec
import pytest
from msgspec.structs import replace

from bridges.kinds.charger.refusals import ChargerRefusal
from bridges.messages import definitions as d
from bridges.messages import topics, words
from bridges.messages.heard import Heard
from bridges.messages.topics import Topic
from workbench.graph.exchange import step
from workbench.graph.join import CommandLine
from workbench.graph.requests import Failed, Fulfilled, Request, RequestProgress
from workbench.graph.requests.charger import ChargeCancel, QueuedCancel, QueuedCharge, RobotCharge
from workbench.graph.requests.door import DoorMove
from workbench.graph.requests.lift import LiftEnd, LiftRide

ME, OTHER = "fleet/robot", "fleet/other"
LINE = CommandLine(("send", "…"), ("--direct", "--localhost"))
RIDE = LiftRide("Lift1", "L3", ME, direct=True, line=LINE)
LIFT = d.LiftState(
    lift_name="Lift1",
    available_floors=("L1", "L2", "L3"),
    current_floor="L1",
    current_mode=d.LiftMode.MODE_HUMAN,
)
GRANTED = replace(LIFT, session_id=ME, current_mode=2)
ARRIVED = replace(GRANTED, current_floor="L3", door_state=2)
DOOR = d.DoorState(door_name="ward", current_mode=d.DoorMode(0))
CHARGER = d.ChargerState(state=1, charger_name="a")


@dataclass
class Ran:
    """One run of `send`: each request with its time (s), the hints, and the outcome with its time
    (s)."""

    sent: list[tuple[float, words.Requested]]
    hints: list[str]
    outcome: Fulfilled | Failed
    at: float


def tell(
    request: Request,
    story: Iterable[tuple[float, d.Message]] = (),
    *,
    listeners: int = 1,
    listen_from: float = 0.0,
    timeout_s: float = 10.0,
    graph: str = "",
    told: Mapping[str, str] | None = None,
) -> Ran:
    """Run `send` in steps of 0.1 s from 0 s on. Deliver each message of the story at its time."""
    left = sorted(story, key=lambda entry: entry[0])
    seen = RequestProgress(0.0, timeout_s, graph=graph, told=told or {})
    ran = Ran([], [], Fulfilled(""), 0.0)
    for tick in range(10_000):
        now = round(tick * 0.1, 1)
        while left and left[0][0] <= now:
            at, message = left.pop(0)
            seen = seen.hears(Heard(at, at, "", message), request.about)
        seen = replace(seen, listeners=listeners if now >= listen_from else 0)
        todo = step(request, seen, now)
        if todo.hint and todo.hint not in ran.hints:
            ran.hints.append(todo.hint)
            seen = replace(seen, hinted=seen.hinted | {todo.hint})
        if todo.outcome is not None:
            ran.outcome, ran.at = todo.outcome, now
            return ran
        if todo.send is not None:
            ran.sent.append((now, todo.send))
            seen = seen.sends(now)
    raise AssertionError("it never ended")


def every_second(state: d.Message, until: float = 20.0) -> list[tuple[float, d.Message]]:
    return [(0.5 + n, state) for n in range(int(until))]


def heartbeat(*requesters: str) -> d.SupervisorHeartbeat:
    sessions = tuple(d.Session(d.Time(), requester) for requester in requesters)
    return d.SupervisorHeartbeat((d.DoorSessions("ward", sessions),))


# --- times of sending --------------------------------------------------------------------------


def test_a_lift_is_asked_for_as_fleets_ask_once_a_second_until_it_is_there() -> None:
    ran = tell(RIDE, [(0.5, LIFT), (1.5, GRANTED), (2.5, GRANTED), (2.8, ARRIVED)])
    request = d.LiftRequest("Lift1", d.Time(), ME, 1, "L3", 2)
    assert ran == Ran(
        [(0.5, request), (1.5, request), (2.5, request)],
        [],
        Fulfilled(
            "Lift1 is at L3, door open, held by fleet/robot; to end that session:"
            " rmf-bridge send lift Lift1 --end --direct --localhost"
        ),
        2.8,
    )


def test_a_request_waits_for_a_first_state_but_not_for_ever() -> None:
    assert [at for at, _ in tell(RIDE, timeout_s=3.5).sent] == [2.0, 3.0]


def test_nothing_is_sent_while_nobody_listens_and_a_supervisor_is_missed() -> None:
    typed = ("send", "lift", "Lift1", "L3", "--session", "my robot", "--localhost")
    request = LiftRide("Lift1", "L3", ME, line=CommandLine(typed, ("--localhost",)))
    ran = tell(request, every_second(LIFT), listeners=0, timeout_s=5.0)
    missed = (
        "no lift supervisor runs in this domain: no node publishes lift_requests;"
        " lifts heard: Lift1; to ask the lift's own daemon:"
        " rmf-bridge send lift Lift1 L3 --session 'my robot' --localhost --direct"
    )
    assert ran == Ran([], [missed], Failed("gave up after 5 s"), 5.0)


def test_a_listener_that_comes_late_is_served() -> None:
    ran = tell(RIDE, [(0.5, LIFT), (4.2, ARRIVED)], listen_from=4.0)
    assert [at for at, _ in ran.sent] == [4.0]
    assert isinstance(ran.outcome, Fulfilled)


@pytest.mark.parametrize(
    ("direct", "lift", "door"),
    [
        (True, topics.LIFT_REQUESTS, topics.DOOR_REQUESTS),
        (False, topics.ADAPTER_LIFT_REQUESTS, topics.ADAPTER_DOOR_REQUESTS),
    ],
)
def test_requests_go_to_the_supervisors_unless_direct(
    direct: bool, lift: Topic[d.LiftRequest], door: Topic[d.DoorRequest]
) -> None:
    assert LiftRide("x", "L1", ME, direct=direct).topic == lift
    assert LiftEnd("x", "", direct=direct).topic == lift
    assert DoorMove("x", True, ME, direct=direct).topic == door
    assert RobotCharge("x", "f", "r", "id", 0).topic == topics.CHARGER_REQUESTS
    assert ChargeCancel("x", "id").topic == topics.CHARGER_CANCELS


# --- lifts -------------------------------------------------------------------------------------


def test_an_arrival_seen_before_the_request_does_not_count() -> None:
    ran = tell(RIDE, [(0.5, ARRIVED)], listen_from=1.0, timeout_s=3.0)
    assert isinstance(ran.outcome, Failed)


@pytest.mark.parametrize(
    "nearly",
    [
        replace(ARRIVED, session_id=OTHER),
        replace(ARRIVED, session_id=""),
        replace(ARRIVED, current_floor="L2"),
        replace(ARRIVED, current_floor=""),
        replace(ARRIVED, door_state=1),
    ],
)
def test_a_state_that_fits_in_three_of_four_fields_is_not_an_arrival(nearly: d.LiftState) -> None:
    assert isinstance(tell(RIDE, every_second(nearly)).outcome, Failed)


def test_granted_only_is_content_with_the_session() -> None:
    request = LiftRide("Lift1", "L3", ME, True, direct=True)
    ran = tell(request, [(0.5, LIFT), (1.0, GRANTED)])
    assert ran.at == 1.0
    assert isinstance(ran.outcome, Fulfilled)


def test_a_floor_that_is_not_served_fails_at_once_with_the_nearest_name() -> None:
    request = LiftRide("Lift1", "l3", ME, direct=True)
    ran = tell(request, every_second(LIFT))
    assert ran == Ran([], [], Failed("Lift1 serves L1, L2, L3, not 'l3'; did you mean 'L3'?"), 0.5)


def test_where_a_robot_may_be_in_the_car_the_remedy_asks_to_look_into_it() -> None:
    held = replace(LIFT, session_id=OTHER, current_mode=d.LiftMode(2))
    seen = replace(
        RequestProgress(0.0, 10.0), states=(held,), stated_at=1.0, told={"boarded": "yes"}
    )
    assert next(iter(RIDE.obstacles(seen))).remedy == (
        "a robot may be in the car; if the car is empty:"
        " rmf-bridge release Lift1 --car-empty --localhost"
    )


@pytest.mark.parametrize(
    ("state", "reason"),
    [
        (
            replace(LIFT, session_id=OTHER, current_mode=2),
            "Lift1 is held by fleet/other;"
            " to end that session: rmf-bridge send lift Lift1 --end --direct --localhost\n"
            "gave up after 10 s; last state: car at L1, door closed, mode AGV, held by fleet/other",
        ),
        (
            replace(LIFT, current_mode=3),
            "Lift1 serves no robot while its mode is FIRE"
            " (last state: car at L1, door closed, mode FIRE)",
        ),
        (
            LIFT,
            "Lift1 did not grant the session: see its daemon's log"
            " (last state: car at L1, door closed, mode HUMAN)",
        ),
        (
            replace(LIFT, session_id=ME),
            "Lift1 granted the session, but its mode is HUMAN, not AGV"
            " (a key switch, or people still use it)"
            " (last state: car at L1, door closed, mode HUMAN, held by fleet/robot)",
        ),
        (
            GRANTED,
            "Lift1 granted the session, but the car has not come to L3"
            " (last state: car at L1, door closed, mode AGV, held by fleet/robot)",
        ),
        (
            replace(ARRIVED, door_state=1),
            "the car is at L3, but its door is not seen open"
            " (last state: car at L3, door moving, mode AGV, held by fleet/robot)",
        ),
    ],
)
def test_a_ride_that_fails_says_what_stands_in_its_way(state: d.LiftState, reason: str) -> None:
    ran = tell(RIDE, every_second(state))
    assert isinstance(ran.outcome, Failed)
    assert ([*ran.hints, ran.outcome.text], ran.at) == (reason.splitlines(), 10.0)


def test_the_remedy_is_printed_within_seconds_and_not_only_at_the_end() -> None:
    held = replace(LIFT, session_id=OTHER, current_mode=2)
    ran = tell(RIDE, every_second(held), timeout_s=4.0)
    assert ran.hints == [
        "Lift1 is held by fleet/other;"
        " to end that session: rmf-bridge send lift Lift1 --end --direct --localhost"
    ]


def test_a_simulation_that_is_not_heard_is_looked_for_on_loopback() -> None:
    typed = ("send", "lift", "Lift1", "L3", "--session", "me", "--direct")
    request = LiftRide("Lift1", "L3", "me", direct=True, line=CommandLine(typed, ("--direct",)))
    assert tell(request, listeners=0).hints == [
        "no lift daemon runs in this domain: no node subscribes to lift_requests;"
        " nothing is heard; for a simulation on the loopback interface:"
        " rmf-bridge send lift Lift1 L3 --session me --direct --localhost"
    ]


def test_an_unknown_name_is_compared_with_those_that_are_heard() -> None:
    there = every_second(replace(LIFT, lift_name="lift1")) + every_second(
        replace(LIFT, lift_name="Goods")
    )
    text = "no 'Lift1' on lift_states; lifts heard: Goods, lift1; did you mean 'lift1'?"
    ran = tell(RIDE, there)
    assert (ran.hints, ran.outcome) == ([text], Failed("gave up after 10 s"))


def test_a_graph_without_any_state_is_said_to_be_empty() -> None:
    ran = tell(RIDE, graph="dds in domain 7, on this machine alone")
    assert (ran.hints, ran.outcome) == (
        [
            "no lift is heard on lift_states;"
            " nothing is heard by dds in domain 7, on this machine alone;"
            " is the device in another domain (--domain-id), on another transport (--transport),"
            " or on another machine (without --localhost)?"
            " rmf-bridge status on the daemon's machine shows domain and transport"
        ],
        Failed("gave up after 10 s"),
    )


def test_a_waiting_user_is_informed_after_three_seconds_and_not_again_at_the_end() -> None:
    assert tell(RIDE, every_second(DOOR), timeout_s=2.9).hints == []
    ran = tell(RIDE, every_second(DOOR), timeout_s=3.5)
    assert (ran.hints, ran.outcome) == (
        ["no lift is heard on lift_states; heard: door ward"],
        Failed("gave up after 3.5 s"),
    )


@pytest.mark.parametrize("listeners", [0, 1])
def test_a_name_of_another_kind_ends_the_wait_at_once(listeners: int) -> None:
    request = DoorMove("Lift1", True, ME)
    ran = tell(request, every_second(LIFT), listeners=listeners)
    assert (ran.outcome, ran.at) == (
        Failed("Lift1 is a lift, not a door; rmf-bridge send lift --help"),
        3.0,
    )


def test_a_door_with_a_lifts_name_is_asked_all_the_same() -> None:
    request = DoorMove("Lift1", True, ME, direct=True)
    named = replace(DOOR, door_name="Lift1", current_mode=d.DoorMode(2))
    ran = tell(request, [*every_second(LIFT), *every_second(named)])
    assert ran.outcome == Fulfilled("Lift1 is open")


def test_a_daemon_that_falls_silent_is_named_as_the_reason() -> None:
    ran = tell(RIDE, every_second(GRANTED, until=3.0))
    assert ran.outcome == Failed("Lift1 fell silent 8 s ago: is its daemon still running?")


def test_end_takes_the_holder_from_the_first_state_and_tells_by_door_open_that_a_person_ends_it() -> (
    None
):
    ran = tell(LiftEnd("Lift1", "", direct=True), [(0.5, GRANTED), (1.2, GRANTED), (1.8, LIFT)])
    end = d.LiftRequest("Lift1", d.Time(), ME, 0, "", 2)
    assert ran == Ran(
        [(0.5, end), (1.5, end)], [], Fulfilled("Lift1 is no longer held by fleet/robot"), 1.8
    )


def test_end_without_a_state_sends_nothing_as_it_knows_no_holder() -> None:
    ran = tell(LiftEnd("Lift1", "", direct=True), timeout_s=5.0)
    assert ran.sent == []
    assert isinstance(ran.outcome, Failed)


def test_end_of_a_free_lift_is_done_before_it_begins() -> None:
    ran = tell(LiftEnd("Lift1", "", direct=True), every_second(LIFT))
    assert ran == Ran([], [], Fulfilled("Lift1 has no session: nothing to end"), 0.5)


def test_end_of_a_given_session_is_sent_once_even_to_a_lift_that_does_not_show_it() -> None:
    ran = tell(LiftEnd("Lift1", ME, direct=True), every_second(LIFT))
    assert [at for at, _ in ran.sent] == [0.5]
    assert ran.outcome == Fulfilled("Lift1 is not held by fleet/robot: nothing to end")


def test_ending_a_session_that_does_not_have_the_lift_says_who_has_it() -> None:
    ran = tell(LiftEnd("Lift1", OTHER, direct=True), every_second(GRANTED))
    assert [at for at, _ in ran.sent] == [0.5]
    assert ran.outcome == Fulfilled(
        "Lift1 is not held by fleet/other: nothing to end; fleet/robot has it"
    )


# --- doors -------------------------------------------------------------------------------------


def moved(mode: int) -> d.DoorState:
    return replace(DOOR, current_mode=d.DoorMode(mode))


def test_a_door_is_open_when_it_says_so_after_our_request() -> None:
    request = DoorMove("ward", True, ME, direct=True)
    ran = tell(request, [(0.5, moved(2)), (1.2, moved(1)), (1.9, moved(2))], listen_from=1.0)
    asked = d.DoorRequest(d.Time(), ME, "ward", d.DoorMode(2))
    assert ran == Ran([(1.0, asked)], [], Fulfilled("ward is open"), 1.9)


def test_through_the_supervisor_an_open_door_counts_once_the_heartbeat_lists_us() -> None:
    request = DoorMove("ward", True, ME, direct=False)
    ran = tell(request, [*every_second(moved(2)), (2.2, heartbeat(OTHER)), (3.3, heartbeat(ME))])
    assert (ran.outcome, ran.at) == (Fulfilled("ward is open"), 3.3)
    alone = tell(request, every_second(moved(2)))
    assert alone.outcome == Failed(
        "ward is open, but no heartbeat of a door supervisor confirms it (last state: open)"
    )


def test_through_the_supervisor_a_closed_door_is_not_ours_while_the_heartbeat_lists_us() -> None:
    request = DoorMove("ward", False, ME, direct=False)
    story = [*every_second(moved(0)), (0.7, heartbeat(ME)), (2.2, heartbeat())]
    ran = tell(request, [(0.5, moved(2)), (0.6, moved(0)), *story])
    assert (ran.outcome, ran.at) == (Fulfilled("ward is closed"), 2.2)


@pytest.mark.parametrize(
    ("opened", "mode", "reason"),
    [
        (True, 0, "ward did not open"),
        (True, 3, "the daemon cannot reach the controller of ward"),
        (True, 4, "the contacts of ward contradict each other, or the door took too long"),
        (False, 2, "ward is held open by fleet/other"),
    ],
)
def test_a_door_that_fails_says_why(opened: bool, mode: int, reason: str) -> None:
    request = DoorMove("ward", opened, ME, direct=False)
    ran = tell(request, [*every_second(moved(mode)), (1.0, heartbeat(OTHER))])
    assert isinstance(ran.outcome, Failed)
    assert ran.outcome.text.startswith(f"{reason} (last state: ")


def test_a_door_that_stays_open_with_nobody_holding_it_is_blocked() -> None:
    ran = tell(DoorMove("ward", False, ME, direct=True), every_second(moved(2)))
    assert ran.outcome == Failed(
        "ward was released, but something keeps it open (last state: open)"
    )


# --- chargers ----------------------------------------------------------------------------------

CHARGE = RobotCharge("a", "fleet", "robot", "r1", 30)


@pytest.mark.parametrize("state", [2, 3, 4])
def test_a_charger_that_shows_our_request_has_taken_it(state: int) -> None:
    ran = tell(CHARGE, [(0.5, CHARGER), (1.6, replace(CHARGER, state=state, request_id="r1"))])
    request = d.ChargerRequest("a", "fleet", "robot", d.Duration(30), "r1")
    assert ran.sent == [(0.5, request), (1.5, request)]
    assert isinstance(ran.outcome, Fulfilled)


@pytest.mark.parametrize(
    ("state", "reason"),
    [
        (
            CHARGER,
            "a did not accept the request: see its daemon's log (last state: idle)",
        ),
        (
            replace(CHARGER, state=3, request_id="r0"),
            "a serves request r0; to cancel that request: rmf-bridge send charger a --cancel r0\n"
            "gave up after 10 s; last state: charging, for request r0",
        ),
        (
            replace(CHARGER, state=200, request_id="r1", error_message="foreign object"),
            "a reports an error: foreign object (last state: error: foreign object, for request r1)",
        ),
    ],
)
def test_a_charger_that_does_not_serve_us_says_why(state: d.ChargerState, reason: str) -> None:
    ran = tell(CHARGE, every_second(state))
    assert isinstance(ran.outcome, Failed)
    assert [*ran.hints, ran.outcome.text] == reason.splitlines()


REFUSAL = ChargerRefusal(
    request_id="r1",
    charger="a",
    robot="fleet/robot",
    reason="charger occupied",
    state="CHARGING",
    held_by="fleet/other",
    held_request="r0",
)


def test_a_refusal_ends_the_command_at_once_and_says_who_has_the_charger() -> None:
    busy = replace(CHARGER, state=3, request_id="r0")
    others = msgspec.structs.replace(REFUSAL, request_id="r7")
    ran = tell(CHARGE, [(0.5, busy), (0.6, others.message()), (0.7, REFUSAL.message())])
    text = (
        "a refuses the request: charger occupied: fleet/other has it (request r0);"
        " to cancel that request: rmf-bridge send charger a --cancel r0"
    )
    assert (ran.outcome, ran.at) == (Failed(text), 0.7)


def test_a_refusal_that_a_cancel_would_not_help_proposes_none() -> None:
    unknown = msgspec.structs.replace(REFUSAL, reason="robot has no receiver here")
    ran = tell(CHARGE, [(0.5, CHARGER), (0.7, unknown.message())])
    text = "a refuses the request: robot has no receiver here: fleet/other has it (request r0)"
    assert ran.outcome == Failed(text)


def test_a_refusal_of_a_charger_that_nobody_has_names_its_error() -> None:
    hot = msgspec.structs.replace(
        REFUSAL, reason="charger in error", held_by="", held_request="", error="station: hot"
    )
    ran = tell(CHARGE, [(0.5, CHARGER), (0.7, hot.message())])
    assert ran.outcome == Failed("a refuses the request: charger in error: station: hot")


@pytest.mark.parametrize("after", [CHARGER, replace(CHARGER, state=4, request_id="r1")])
def test_a_cancel_is_done_when_the_charger_lets_go(after: d.ChargerState) -> None:
    held = replace(CHARGER, state=3, request_id="r1")
    ran = tell(ChargeCancel("a", "r1"), [(0.5, held), (1.2, held), (1.8, after)])
    cancel = d.ChargerCancel("a", "r1")
    assert ran == Ran(
        [(0.5, cancel), (1.5, cancel)], [], Fulfilled("a no longer serves request r1"), 1.8
    )


def test_a_cancel_of_an_id_that_the_charger_never_showed_is_a_mistake() -> None:
    held = replace(CHARGER, state=3, request_id="r2")
    ran = tell(ChargeCancel("a", "r1"), [(0.5, held), (1.5, held)])
    assert ran.outcome == Failed("a does not serve request 'r1' (state: charging, for request r2)")


# --- the chargers' coordinator -----------------------------------------------------------------

QUEUE = QueuedCharge("any", "fleet", "robot", "r1", 30, line=CommandLine((), ("--localhost",)))
OTHERS = replace(CHARGER, state=3, request_id="r9", robot_fleet="fleet", robot_name="other")


def test_a_request_for_any_charger_is_done_when_one_of_them_shows_the_robot() -> None:
    given = replace(
        CHARGER, charger_name="b", state=2, request_id="x", robot_fleet="fleet", robot_name="robot"
    )
    assert [QUEUE.about(state) for state in (CHARGER, OTHERS, given)] == [False, False, True]
    ran = tell(QUEUE, [(0.5, OTHERS), (1.2, given)])
    request = d.ChargerRequest("", "fleet", "robot", d.Duration(30), "r1")
    assert ran.sent == [(0.5, request)]
    assert ran.hints == []
    assert ran.outcome == Fulfilled("b is assigned for fleet/robot")


OURS = replace(CHARGER, charger_name="b", request_id="x", robot_fleet="fleet", robot_name="robot")


def test_a_charger_that_has_released_the_robot_from_its_last_charge_does_not_serve_it() -> None:
    ran = tell(QUEUE, every_second(replace(OURS, state=4), until=4.0), timeout_s=5.0)
    assert ran.outcome == Failed("gave up after 5 s")
    assert ran.hints[0].startswith("no charger serves fleet/robot yet: the robot waits in the")
    given = replace(OURS, charger_name="c", state=2)
    both = [(0.5, replace(OURS, state=4)), (1.2, given), (1.2, replace(OURS, state=4))]
    assert tell(QUEUE, both).outcome == Fulfilled("c is assigned for fleet/robot")


@pytest.mark.parametrize("state", [2, 3, 4])
def test_a_refusal_counts_although_a_charger_still_shows_the_robots_earlier_charge(
    state: int,
) -> None:
    unsuited = msgspec.structs.replace(REFUSAL, reason="station does not suit the robot")
    states = [(0.5, replace(OURS, state=state)), (0.6, replace(OURS, state=state))]
    ran = tell(QUEUE, [*states, (0.6, unsuited.message())])
    assert isinstance(ran.outcome, Failed)
    assert "station does not suit the robot" in ran.outcome.text


def test_a_robot_that_waits_is_said_to_wait_and_how_to_withdraw_it() -> None:
    waits = tell(QUEUE, every_second(OTHERS), timeout_s=5.0)
    text = (
        "no charger serves fleet/robot yet: the robot waits in the charger coordinator's queue"
        " (see `rmf-bridge watch --localhost`), or the request was refused (see the coordinator's log);"
        " to withdraw the request: rmf-bridge send charger any --queue --cancel r1 --localhost"
    )
    assert (waits.hints, waits.outcome) == ([text], Failed("gave up after 5 s"))


def test_a_chosen_charger_is_named_in_the_request() -> None:
    request = QueuedCharge("a", "fleet", "robot", "r1", 30)
    assert tell(request, []).sent[0][1] == d.ChargerRequest(
        "a", "fleet", "robot", d.Duration(30), "r1"
    )


def test_a_withdrawal_is_done_when_it_is_sent() -> None:
    ran = tell(QueuedCancel("any", "r1"), [])
    assert ran.sent == [(2.0, d.ChargerCancel("", "r1"))]
    assert ran.outcome == Fulfilled("the charger coordinator was told that request r1 is withdrawn")
