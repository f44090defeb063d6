"""The lift supervisor's core, for one lift: the order of sessions, and the requests to the lift's node.

This supervisor replaces RMF's supervisor (rmf_ros2, lift_supervisor/Node.cpp). Fleet adapters send
their requests on `adapter_lift_requests`. The supervisor passes on the requests of one session at a
time, on `lift_requests`, until the lift's states show that the lift's node has obeyed. This session has
its turn, and is called the holder. `bridges/kinds/shared/freshness.py` rejects stale requests.

Rules:
LIFT-SUPERVISOR-1. Sessions are served in the order of their first requests. A session leaves the queue
   at its END, or after `silent_after_s` without a request. While the lift is silent this time does not
   run, because adapters repeat their requests only when the lift's states come. A session also leaves
   the queue, or loses its turn, if it repeats a request for a floor that the lift does not serve. The
   lift's states name the floors, so such a request is in the queue only if it came before them, or if
   the floors have changed. A session that the lift shows stays.
LIFT-SUPERVISOR-2. The lift's states name the session that has the lift. This session is served before
   the queue if its robot still requests it. If nobody has requested the session for `orphan_after_s`,
   the supervisor ends the session.
LIFT-SUPERVISOR-3. One session at a time has its turn. Its request is sent when it is new or has
   changed. The request is repeated when the lift's state does not fulfil it. The request is also
   repeated when the adapter has repeated it, because the lift's node would otherwise consider RMF
   silent. The request is never sent while the lift shows another session.
LIFT-SUPERVISOR-4. Only END ends a turn. Usually the holder sends END, wherever the lift is and in any
   mode. For a silent holder the supervisor sends END. It also does so for a holder of a floor that is
   not served (LIFT-SUPERVISOR-1). If the lift never showed the holder's session,
   the supervisor sends END after `silent_after_s`. Otherwise the supervisor sends END after
   `holder_ttl_s`, if the site has set that time. END is repeated until a later state shows another
   session or none. Only after that is the next session served.
LIFT-SUPERVISOR-5. While the lift is in fire, emergency or offline mode, no robot is sent to the lift
   and the queue waits. The supervisor still passes on END. It also passes on requests for HUMAN mode,
   because they call no robot to the lift.
LIFT-SUPERVISOR-6. During the quiet start (the first `quiet_start_s`), and whenever another supervisor
   publishes, our supervisor only listens. After that it continues from the states and requests that it
   has heard in the meantime. Therefore a restart ends no ride.
LIFT-SUPERVISOR-7. Two messages are at least GAP_S apart. An unchanged message is repeated after
   REPEAT_S at the earliest.
"""

import math
from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift_supervisor.memory import (
    LiftSupervisorLimits,
    SessionClaim,
    SupervisedLift,
    Turn,
)
from bridges.kinds.lift_supervisor.report import SupervisorReport, alarms, report
from bridges.kinds.lift_supervisor.signals import Event, LiftStateHeard, RideEnded, RideRequested
from bridges.kinds.shared.decision import Decision
from bridges.kinds.shared.durations import FORGOTTEN_S, NEVER, SILENT_S, due_at
from bridges.kinds.shared.freshness import hear
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.messages.definitions import LiftRequest, LiftRequestDoor, LiftRequestType
from bridges.messages.topics import LIFT_REQUESTS

MAX_CLAIMS: Final = 100

END: Final = LiftRequestType.REQUEST_END_SESSION
AGV: Final = LiftRequestType.REQUEST_AGV_MODE

Decided = Decision[SupervisedLift, None, SupervisorReport]


def initial(lift: str, started_at: float) -> SupervisedLift:
    """Return the memory at start, before any message was heard. We may not publish yet."""
    return SupervisedLift(lift, started_at)


def idle(memory: SupervisedLift, now: float) -> bool:
    """Return whether the memory of this lift may be dropped, after a long silence.

    A claim is a session that wants the lift. A lift without claims is dropped after FORGOTTEN_S. If the
    lift comes back, its states show whether a session is left that must still be ended. A lift for
    which robots only wait is dropped after 10 times FORGOTTEN_S. These robots request again when the
    lift is back. A lift that has claims and shows a session is never dropped.
    """
    heard_at = max(memory.heard_at, memory.shown_at)
    has_it = memory.session_shown or (memory.turn and memory.turn.seen)
    long_s = NEVER if has_it else 10 * FORGOTTEN_S
    return now >= heard_at + (long_s if memory.claims else FORGOTTEN_S)


def decide(
    memory: SupervisedLift, event: Event, now: float, limits: LiftSupervisorLimits
) -> Decided:
    """Apply the event, choose the session that has its turn, and publish a request that is due."""
    memory, refused = _take(memory, event, now, limits)
    memory = _forget_silent(memory, now, limits)
    memory = _take_turns(memory, now, limits)
    message = wanted(memory)
    due = now >= _due_at(memory, message)
    if due:
        memory = replace(memory, sent=message, last_sent=message, sent_at=now, prompted=False)
    may_come = tuple(alarms(memory, now, limits))
    return Decision(
        memory,
        None,
        report(memory, [fault for at, fault in may_come if now >= at]),
        _wake_at(memory, [_due_at(memory, message), *(at for at, _ in may_come)], now, limits),
        refused,
        ((LIFT_REQUESTS, message),) if due and message else (),
    )


# --- events that come in ------------------------------------------------------------------------


def _take(
    memory: SupervisedLift, event: Event, now: float, limits: LiftSupervisorLimits
) -> tuple[SupervisedLift, str]:
    match event:
        case RideRequested() | RideEnded():
            memory, refused = _listen(memory, event, now, limits)
            if refused:
                return memory, refused
            if isinstance(event, RideEnded):
                return _end(memory, event.session, now, event.by_person), ""
            return _ask(memory, event, now)
        case LiftStateHeard():
            return _see(memory, event, now), ""
        case MaySpeak(yes, waits=passive):
            return _speak(memory, yes, passive), ""
        case _:  # only time has passed
            return memory, ""


def _listen(
    memory: SupervisedLift,
    event: RideRequested | RideEnded,
    now: float,
    limits: LiftSupervisorLimits,
) -> tuple[SupervisedLift, str]:
    """Note the request's stamp. Also return the reason for a refusal, "" if the stamp is fresh
    enough."""
    requesters, refused = hear(
        memory.requesters,
        event.session,
        event.stamp,
        now,
        memory.rules(now, limits),
        age_s=event.age_s,
        ends=isinstance(event, RideEnded),
        holders={claim.session for claim in memory.claims},
    )
    return replace(memory, heard_at=now, requesters=requesters), refused


def _ask(memory: SupervisedLift, request: RideRequested, now: float) -> tuple[SupervisedLift, str]:
    """Enter the session into the queue. A repeated or changed request keeps its session's place."""
    before = memory.claim(request.session)
    served = memory.shown.floors if memory.shown else ()
    if served and request.target.request_type == AGV and request.target.floor not in served:
        return _refuse(memory, before, served, now), "floor not served"
    if before is None and len(memory.claims) == MAX_CLAIMS:
        return memory, "queue full"
    since = before.since if before else now
    claim = SessionClaim(request.session, request.target, since, now)
    turn = memory.turn
    holds = turn is not None and turn.session == request.session and not turn.ends
    return replace(_with(memory, before, claim), prompted=memory.prompted or holds), ""


def _refuse(
    memory: SupervisedLift, before: SessionClaim | None, served: tuple[str, ...], now: float
) -> SupervisedLift:
    """Note that the requester of a refused request is alive. But drop its claim if the lift does not
    serve the claimed floor either, and does not show its session. The lift would refuse this claim for
    ever."""
    if before is None:
        return memory
    target, holds = before.target, before.session == memory.session_shown
    if holds or target.request_type != AGV or target.floor in served:
        return _with(memory, before, replace(before, heard_at=now))
    return _end(memory, before.session, now)


def _with(
    memory: SupervisedLift, before: SessionClaim | None, claim: SessionClaim
) -> SupervisedLift:
    if before is None:
        return replace(memory, claims=(*memory.claims, claim))
    return replace(memory, claims=tuple(claim if c is before else c for c in memory.claims))


def _end(
    memory: SupervisedLift, session: str, now: float, by_person: bool = False
) -> SupervisedLift:
    """Remove the session from the queue. If the session has the lift, or has its turn, send END to the
    lift's node. A person's END takes the place of another END of that session."""
    memory, turn = _without(memory, session), memory.turn
    has_it = session in (memory.session_shown, turn.session if turn else "")
    if not has_it or not memory.may_speak:
        return memory
    if turn and turn.ends and (turn.by_person or not by_person or turn.session != session):
        return memory
    return _begin(memory, Turn(session, now, ends=True, by_person=by_person))


def _without(memory: SupervisedLift, session: str) -> SupervisedLift:
    return replace(memory, claims=tuple(c for c in memory.claims if c.session != session))


def _see(memory: SupervisedLift, shown: LiftStateHeard, now: float) -> SupervisedLift:
    """Apply a state of the lift. The state may confirm an END, make a repeat of the request necessary,
    or show another session."""
    flowed = now <= memory.shown_at + SILENT_S
    same = flowed and shown.session == memory.session_shown
    turn, prompted = memory.turn, memory.prompted
    if turn and turn.ends:
        gone = memory.sent is not None and shown.session != turn.session
        turn, prompted = (None, False) if gone else (turn, True)
    elif turn:
        claim = memory.claim(turn.session)
        assert claim is not None
        turn = replace(turn, seen=turn.seen or shown.session == turn.session)
        prompted = prompted or not shown.satisfies(turn.session, claim.target)
    return replace(
        memory,
        turn=turn,
        prompted=prompted,
        shown=shown,
        shown_at=now,
        session_since=memory.session_since if same else now,
        flowing_since=memory.flowing_since if flowed else now,
    )


def _speak(memory: SupervisedLift, yes: bool, passive: str) -> SupervisedLift:
    """Apply the permission to publish. If we may not publish, no session has its turn. When we may
    publish again, the lift's states show which session has the lift."""
    turn = memory.turn if yes else None
    return replace(memory, may_speak=yes, passive=passive, turn=turn)


# --- turns -------------------------------------------------------------------------------------


def _forget_silent(
    memory: SupervisedLift, now: float, limits: LiftSupervisorLimits
) -> SupervisedLift:
    """Drop the claims of waiting sessions that are silent. The claim of the session that has its turn
    is dropped only at its END."""
    holder = memory.turn.session if memory.turn and not memory.turn.ends else ""
    staying = tuple(
        claim
        for claim in memory.claims
        if claim.session == holder or now < memory.gone_at(claim, now, limits.silent_after_s)
    )
    return replace(memory, claims=staying)


def _begin(memory: SupervisedLift, turn: Turn) -> SupervisedLift:
    return replace(memory, turn=turn, sent=None, prompted=False)


def _take_turns(memory: SupervisedLift, now: float, limits: LiftSupervisorLimits) -> SupervisedLift:
    turn, shown = memory.turn, memory.session_shown
    if not memory.may_speak or (turn and turn.ends):
        return memory
    if shown and (turn is None or shown != turn.session):
        return _obey_the_lift(memory, shown, now, limits)
    if turn:
        return _let_go(memory, turn, now, limits)
    if memory.claims and not memory.nobody_is_sent:
        return _begin(memory, Turn(memory.claims[0].session, now))
    return memory


def _obey_the_lift(
    memory: SupervisedLift, shown: str, now: float, limits: LiftSupervisorLimits
) -> SupervisedLift:
    """Serve or end a session that the lift shows although we did not begin it. Such a session is from
    before our restart, or from another node."""
    if memory.claim(shown):
        return _begin(memory, Turn(shown, now, seen=True))
    if memory.shown_at >= memory.session_since + limits.orphan_after_s:
        return _begin(memory, Turn(shown, now, ends=True))
    return memory


def _let_go(
    memory: SupervisedLift, turn: Turn, now: float, limits: LiftSupervisorLimits
) -> SupervisedLift:
    """End the turn of a silent holder. If the lift never showed the session, the turn ends after
    `silent_after_s`, else after `holder_ttl_s`."""
    claim = memory.claim(turn.session)
    assert claim is not None
    after_s = limits.holder_ttl_s if turn.seen else limits.silent_after_s
    if now < memory.gone_at(claim, now, after_s):
        return memory
    return _begin(_without(memory, turn.session), Turn(turn.session, now, ends=True))


# --- messages that go out -----------------------------------------------------------------------


def wanted(memory: SupervisedLift) -> LiftRequest | None:
    """Make the present request to the lift's node, without its stamp; None if there is nothing to
    request."""
    turn = memory.turn
    if turn is None:
        return None
    if turn.ends:
        floor = memory.shown.floor if memory.shown else ""
        end = LiftRequest(memory.lift, session_id=turn.session, destination_floor=floor)
        return replace(end, door_state=LiftRequestDoor.DOOR_OPEN) if turn.by_person else end
    claim = memory.claim(turn.session)
    assert claim is not None
    target = claim.target
    somebody_elses = memory.session_shown not in ("", turn.session)
    if somebody_elses or (target.request_type == AGV and memory.nobody_is_sent):
        return None
    return LiftRequest(
        lift_name=memory.lift,
        session_id=turn.session,
        request_type=target.request_type,
        destination_floor=target.floor,
        door_state=target.door,
    )


def _due_at(memory: SupervisedLift, message: LiftRequest | None) -> float:
    """Return the time to send this request. An END that differs from the last END only in its floor
    counts as a repeat."""
    if message is None:
        return NEVER
    new = memory.sent is None or (message != memory.sent and message.request_type != END)
    said = memory.sent is None and message == memory.last_sent  # sent in an earlier turn
    return due_at(memory.sent_at, new=new and not said, again=memory.prompted or said)


def _wake_at(
    memory: SupervisedLift, due: list[float], now: float, limits: LiftSupervisorLimits
) -> float:
    """Return the next time at which the decision may change without an event."""
    if memory.shown is not None and memory.flows(now):
        due.append(math.nextafter(memory.shown_at + SILENT_S, NEVER))
    for claim in memory.claims:
        due.append(memory.gone_at(claim, now, limits.silent_after_s))
        due.append(memory.gone_at(claim, now, limits.holder_ttl_s))
    return min([at for at in due if at > now], default=NEVER)
