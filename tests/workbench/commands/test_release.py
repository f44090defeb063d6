"""`release` first asks RMF's lift supervisor, and then the daemon of the lift itself. If a robot may be
in the car, the command refuses."""

import dataclasses
import io
import time
from collections.abc import Iterable

import pytest
from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.workbench.graph.test_exchange import GRANTED, LIFT, ME
from workbench.commands import send
from workbench.graph.exchange import step
from workbench.graph.join import CommandLine
from workbench.graph.requests import Failed, Fulfilled, RequestProgress
from workbench.graph.requests.lift import LiftEnd, aftermath

LINE = CommandLine(("release", "Lift1"))
RELEASE = LiftEnd("Lift1", "", True, line=LINE)
LOOK = (
    "Lift1 still shows the session, and a robot may be in the car: look inside;"
    " if the car is empty: rmf-bridge release Lift1 --car-empty"
)


def told(
    request: LiftEnd, states: Iterable[d.LiftState], boarded: str, listeners: int = 1
) -> tuple[list[tuple[int, str]], list[str], Fulfilled | Failed]:
    """Run `release`, and deliver one state of the lift each second.

    Return (time in s, receiver) for each request, the hints, and the outcome. The receiver is
    "supervisor", or "direct" for the lift's own daemon.
    """
    seen = RequestProgress(0.0, 10.0, listeners, told={"boarded": boarded})
    sent, hints = list[tuple[int, str]](), list[str]()
    for now, state in enumerate(states):
        seen = seen.hears(Heard(now, now, "", state), request.about)
        todo = step(request, seen, now)
        if todo.outcome is not None:
            return sent, hints, todo.outcome
        hints += [todo.hint] if todo.hint and todo.hint not in hints else []
        if todo.send is not None:
            sent.append((now, "direct" if todo.direct else "supervisor"))
            first = now if seen.first_sent_at is None else seen.first_sent_at
            seen = replace(seen, first_sent_at=first, last_sent_at=now)
    raise AssertionError("it never ended")


def test_the_supervisor_has_five_seconds_before_the_lifts_own_daemon_is_asked() -> None:
    sent, _, outcome = told(RELEASE, [GRANTED] * 6 + [LIFT], boarded="no")
    assert sent == [(n, "supervisor") for n in range(5)] + [(5, "direct")]
    assert outcome == Fulfilled(f"Lift1 is no longer held by {ME}")


@pytest.mark.parametrize("boarded", ["yes", ""])
def test_while_a_robot_may_be_inside_somebody_must_say_that_the_car_is_empty(boarded: str) -> None:
    sent, hints, outcome = told(RELEASE, [GRANTED] * 11, boarded)
    assert {to for _, to in sent} == {"supervisor"}
    assert hints == [LOOK]
    assert isinstance(outcome, Failed)
    assert "look inside" in outcome.text
    sent, *_ = told(dataclasses.replace(RELEASE, car_empty=True), [GRANTED] * 6 + [LIFT], boarded)
    assert sent[-1] == (5, "direct")


def test_without_any_supervisor_the_lifts_own_daemon_is_asked_as_well() -> None:
    sent, hints, _ = told(RELEASE, [GRANTED] * 6 + [LIFT], boarded="no", listeners=0)
    assert sent == [(5, "direct")]
    assert hints == [
        "no lift supervisor runs in this domain: no node publishes lift_requests;"
        " lifts heard: Lift1; the lift's own daemon is asked instead"
    ]


def test_send_end_never_goes_past_the_supervisor() -> None:
    sent, *_ = told(LiftEnd("Lift1"), [GRANTED] * 11, boarded="no")
    assert {to for _, to in sent} == {"supervisor"}


def test_an_adapters_topic_that_only_the_lift_hears_has_no_supervisor() -> None:
    network = MemoryNetwork()
    lift = MemoryTransport(network, "lift")
    lift.subscribe(topics.ADAPTER_LIFT_REQUESTS.live(), print)
    exchange = send._Exchange(MemoryTransport(network, "me"), RELEASE, 10.0, io.StringIO())
    exchange.look()
    assert exchange.seen.listeners == 0
    MemoryTransport(network, "rmf").publisher(topics.LIFT_REQUESTS)
    exchange.look()
    assert exchange.seen.listeners == 1


def test_whether_a_robot_is_inside_is_read_from_the_lifts_own_diagnostics() -> None:
    network = MemoryNetwork()
    lift = MemoryTransport(network, "lift")
    asked: list[d.LiftRequest] = []
    lift.subscribe(topics.LIFT_REQUESTS, asked.append)
    exchange = send._Exchange(MemoryTransport(network, "me"), RELEASE, 10.0, io.StringIO())
    values = (d.KeyValue("kind", "lift"), d.KeyValue("boarded", "no"))
    health = d.DiagnosticStatus(name="node: Lift1", hardware_id="Lift1", values=values)
    other = replace(health, hardware_id="Lift2", values=(values[0], d.KeyValue("boarded", "yes")))
    lift.publisher(topics.DIAGNOSTICS).publish(d.DiagnosticArray(status=(health, other)))
    lift.publisher(topics.LIFT_STATES).publish(GRANTED)
    exchange.look()
    assert exchange.seen.told["boarded"] == "no"
    exchange.seen = replace(exchange.seen, began_at=time.monotonic() - 6.0)
    lift.publisher(topics.LIFT_STATES).publish(GRANTED)
    exchange.look()
    assert [(r.session_id, r.request_type) for r in asked] == [(ME, 0)]


def test_after_the_end_release_watches_who_has_the_lift_and_what_moves() -> None:
    network, out = MemoryNetwork(), io.StringIO()
    lift = MemoryTransport(network, "lift")
    lift.subscribe(topics.ADAPTER_LIFT_REQUESTS.live(), print)
    lift.publisher(topics.LIFT_REQUESTS)
    states = lift.publisher(topics.LIFT_STATES)
    exchange = send._Exchange(MemoryTransport(network, "me"), RELEASE, 10.0, out)
    blue = replace(LIFT, session_id="fleet/blue")
    for state in (GRANTED, LIFT, blue, replace(blue, current_floor="L3", motion_state=1)):
        states.publish(state)
        assert exchange.look() is None
    exchange.watches_until = time.monotonic()
    assert exchange.look() == 0
    lines = [line.split(maxsplit=2)[2] for line in out.getvalue().splitlines()]
    done = lines.index(f"done     Lift1  Lift1 is no longer held by {ME}")
    assert lines[done + 1 :][0].endswith("held by fleet/blue")
    assert lines[-1] == (
        "after    Lift1  fleet/blue has it now; in the 5 s after the release:"
        " the car goes up; floor L1 to L3"
    )


@pytest.mark.parametrize(
    ("states", "text"),
    [
        (
            [LIFT, LIFT],
            "nobody has it now; in the 5 s after the release: neither the car nor its door moved",
        ),
        (
            [LIFT, replace(LIFT, door_state=1), replace(LIFT, door_state=0)],
            "nobody has it now; in the 5 s after the release: door closed to moving to closed",
        ),
        (
            [LIFT],
            "nobody has it now; no state came in 5 s, so it is unknown whether anything moves",
        ),
    ],
)
def test_the_watch_tells_also_that_nothing_moved_or_was_heard(
    states: list[d.LiftState], text: str
) -> None:
    assert aftermath(states) == text


@pytest.mark.parametrize(
    ("state", "hint"),
    [
        (
            GRANTED,
            f"Lift1 is held by {ME}, not by wrong; to end the present session:"
            f" rmf-bridge release Lift1 --session {ME}",
        ),
        (LIFT, "Lift1 is held by nobody, not by wrong"),
    ],
)
def test_without_a_supervisor_a_wrong_session_is_answered_with_the_holder(
    state: d.LiftState, hint: str
) -> None:
    wrong = dataclasses.replace(RELEASE, session="wrong")
    sent, hints, _ = told(wrong, [state] * 11, boarded="", listeners=0)
    assert (sent, hints) == ([], [hint])


def test_without_a_supervisor_a_person_must_look_into_a_car_that_may_hold_a_robot() -> None:
    _, hints, _ = told(RELEASE, [GRANTED] * 11, boarded="", listeners=0)
    assert hints == [
        "no lift supervisor runs in this domain: no node publishes lift_requests;"
        " lifts heard: Lift1; if the car is empty: rmf-bridge release Lift1 --car-empty"
    ]
