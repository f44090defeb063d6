"""Checks of a lift's laws after each message. `lift_laws.py` has the laws themselves."""

from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.lift import HAZARDS
from workbench.judge.history import FROZEN_S, NOT_YET
from workbench.judge.law import KEPT, Doubt, Finding, shown
from workbench.judge.lift_history import (
    ASKED_S,
    ENDS_WITHIN_S,
    GRACE_S,
    LATE_S,
    LiftHistory,
    moves,
)

GRANTS_WITHIN_S: Final = 30.0
GRANT_ASKED: Final = 10
JUMPS_WITHIN_S: Final = 1.5
REFUSED: Final = 3
FOREIGN_S: Final = 2.0
CLOSES_S: Final = 60.0
SUPERVISED_S: Final = 10.0
"""Time (s) without a request on lift_requests after which no supervisor is assumed. The supervisor may
be dead, or may be missing in the recording."""
SETTLED_S: Final = 3.0
"""Time (s) after a node's first state in which the node may still obey requests that we have not
heard."""
_DOORS: Final = frozenset(d.LiftDoor)
_MOTIONS: Final = frozenset(d.LiftMotion)
_MODES: Final = frozenset(d.LiftMode)


def _is_open(history: LiftHistory) -> d.LiftState | None:
    state = history.new
    return state if state is not None and history.claims(state) else None


def numbers(history: LiftHistory) -> Finding:
    state = history.new
    if state is None:
        return None
    found = [
        f"{field} {value}"
        for field, value, known in (
            ("door_state", state.door_state, _DOORS),
            ("motion_state", state.motion_state, _MOTIONS),
            ("current_mode", state.current_mode, _MODES),
            *(("available_modes", mode, _MODES) for mode in state.available_modes[:20]),
        )
        if value not in known
    ]
    return f"{', '.join(found[:3])}: RMF has no such number" if found else KEPT


def other_lift(history: LiftHistory) -> Finding:
    """Check that a session that requested only another lift does not get this lift."""
    session = history.session
    if history.new is None or history.before is None:
        return None
    if not session and history.elsewhere:
        at = next(reversed(history.elsewhere.values()))
        return KEPT if at > history.free_since and history.was_tested(at) else None
    if session in ("", history.session_before) or session not in history.elsewhere:
        return None
    return Doubt(
        f"held by {shown(session)}, which asked only for another lift",
        lambda: session in history.asks,
    )


def own_name(history: LiftHistory) -> Finding:
    """Check that only a session that sent a request gets the lift."""
    session = history.session
    if history.new is None or history.before is None or not session:
        return None
    if session == history.session_before:
        return None
    if session in history.asks:
        return KEPT
    if session in history.elsewhere or history.now - history.since < SETTLED_S:
        return None
    if not history.recorded:
        return None
    return Doubt(
        f"held by {shown(session)}, which never asked for it", lambda: session in history.asks
    )


def grants(history: LiftHistory) -> Finding:
    """Check that a lift that is free and in service grants the first request. MODE_HUMAN is in service:
    people use the free lift, and the node asks for AGV mode after the grant. An attendant's key shows
    as OFFLINE.

    After a ride, the node may refuse other robots for GRACE_S, because the last robot may still be in
    the car.
    """
    if history.new is None or history.before is None:
        return None
    if history.session:
        granted = history.session != history.session_before and history.session in history.asks
        return KEPT if granted else None
    may_be_inside = bool(history.last) and history.offered
    free_s = history.now - history.free_since - (GRACE_S if may_be_inside else 0.0)
    for session, ask in list(history.asks.items()):
        asked = ask.direct and ask.times >= GRANT_ASKED and history.now - ask.direct_at < 3.0
        served = ask.floor in history.new.available_floors or not history.new.available_floors
        long_s = min(free_s, history.now - ask.since)
        if asked and served and session and not ask.human and long_s > GRANTS_WITHIN_S:
            return (
                f"{shown(session)} has asked {ask.times} times in {long_s:.0f} s; the lift is free"
            )
    return None


def bypassed(history: LiftHistory) -> Finding:
    """Check that a fleet adapter's request alone gets no session. Only the supervisor may act on this
    request."""
    session = history.session
    supervised = history.now - history.direct_at <= SUPERVISED_S
    if history.new is None or history.before is None or not supervised:
        return None
    if not session:
        tested = (
            history.free_since < ask.first_at and history.was_tested(ask.first_at)
            for ask in history.asks.values()
            if not ask.direct
        )
        return KEPT if any(tested) else None
    ask = history.asks.get(session)
    if session == history.session_before or ask is None or ask.direct:
        return None

    def excused() -> bool:
        later = history.asks.get(session)
        return later is not None and later.direct

    text = f"held by {shown(session)}, for which the supervisor has sent no request"
    return Doubt(text, excused)


def ended_unasked(history: LiftHistory) -> Finding:
    """Check that a session ends only after an END for this session."""
    old, new, since = history.session_before, history.session, history.held_since
    if history.new is None or history.before is None or not old or not history.recorded:
        return None
    if old == new:
        hazard = history.new.current_mode in HAZARDS
        tested = history.travelled or hazard or history.was_tested(history.rival_at)
        return KEPT if tested else None
    ask = history.asks.get(old)
    if ask is None and since > history.since + SETTLED_S:
        return None  # the session never sent a request, so law L4.own reports the breach
    if history.has_ended(old, since) or (ask and ask.human) or _foreign_end(history, old, since):
        return None
    if ask and ask.disowned:
        return None  # after this END the lift showed the session again, for a robot left in the car
    what = f"session {shown(old)} became {shown(new)}" if new else f"session {shown(old)} ended"

    def excused() -> bool:
        return history.has_ended(old, since) or bool(_foreign_end(history, old, since))

    return Doubt(f"{what}, and no END_SESSION for this session was heard", excused)


def _foreign_end(history: LiftHistory, session: str, since: float) -> str:
    """Return the other session whose END came a moment ago, while this session held the lift. Return ""
    if there is no such session."""
    if history.has_ended(session, since):
        return ""
    others = ((who, at) for who, at in history.ended.items() if who not in ("", session))
    lasted = ((who, at) for who, at in others if at > since + FOREIGN_S)
    return next((who for who, at in lasted if history.now - at < FOREIGN_S), "")


def ended_by_another(history: LiftHistory) -> Finding:
    """Check that an END for a session that does not hold the lift changes nothing."""
    old = history.session_before
    if history.new is None or history.before is None or not old:
        return None
    since = history.granted_at if old == history.session else history.held_since
    other = _foreign_end(history, old, since)
    if not other or old not in history.asks:
        return None
    if old == history.session:
        return KEPT if history.now - history.foreign_end_at < FOREIGN_S else None
    text = f"END_SESSION of {shown(other)} ended the session of {shown(old)}"
    return Doubt(text, lambda: history.has_ended(old, since))


def ends(history: LiftHistory) -> Finding:
    """Check that an END for the holder ends the session, whether or not the END names a floor and a
    door."""
    if history.new is None:
        return None
    if history.bare_refused >= REFUSED:
        return (
            f"{REFUSED} sessions in a row did not end after an END without a floor, which fleet"
            " adapters send"
        )
    if history.session_before and history.session != history.session_before:
        return KEPT if history.bare_end else None
    at, ask = history.ending.at, history.asks.get(history.session)
    if at == NOT_YET or history.now - at < ENDS_WITHIN_S:
        return None
    if ask and ask.goes_on(history.now):
        return None
    bare = history.ending.bare_at == at and history.ending.floor_at == NOT_YET
    floor = " without a floor" if bare else ""
    return f"still held by {shown(history.session)} {history.now - at:.1f} s after its END{floor}"


def stopped(history: LiftHistory) -> Finding:
    state = history.new
    if state is None or not moves(state):
        return None
    return words.described(state) if history.claims(state) else KEPT


def somewhere(history: LiftHistory) -> Finding:
    state = _is_open(history)
    if state is None:
        return None
    return KEPT if state.current_floor else words.described(state)


def no_jump(history: LiftHistory) -> Finding:
    state = _is_open(history)
    if state is None or not state.current_floor:
        return None
    floor, at = history.open_seen
    if floor in ("", state.current_floor):
        return None
    if history.now - at > JUMPS_WITHIN_S:
        return KEPT
    return f"open at {shown(floor)}, and {history.now - at:.1f} s later at {shown(state.current_floor)}"


def in_agv(history: LiftHistory) -> Finding:
    """Check that the door opens for a boarding robot only in AGV mode, when people cannot call the
    car."""
    state = history.new
    if state is None or not (history.offers and history.offered):
        return None
    if state.current_mode == d.LiftMode.MODE_HUMAN:
        return words.described(state)
    return KEPT if state.current_mode == d.LiftMode.MODE_AGV else None


def holds(history: LiftHistory) -> Finding:
    """Check that the door does not close and open again and again while the robot's floor is served."""
    if history.new is None:
        return None
    state, times = _is_open(history), history.closings
    here = state and state.session_id and history.was_asked_to(state.current_floor)
    if here and history.often(history.reopened):
        return "the door left OPEN and was OPEN again within 1 s, 3 times during one stop"
    if here and len(times) == times.maxlen and history.now - times[0] < CLOSES_S:
        return "the door left OPEN and opened again, 3 times within 60 s, though the robot asked for it"
    return KEPT if history.stayed else None


def floors(history: LiftHistory) -> Finding:
    state = history.new
    if state is None or not state.available_floors or not state.current_floor:
        return None
    if state.current_floor in state.available_floors:
        return KEPT
    return f"current_floor {shown(state.current_floor)} is not one of its available_floors"


def destination(history: LiftHistory) -> Finding:
    """Check that the car goes to the floor that its holder requested. A session that the lift resumes
    may still have its former destination."""
    state = history.new
    if state is None or not state.session_id or not state.destination_floor:
        return None
    if state.current_mode in HAZARDS:
        return None  # the car goes to its recall floor
    floor, before = state.destination_floor, history.before
    changed = before is None or floor != before.destination_floor
    resumed = history.session_before != state.session_id and _again(history, state)
    within_s = ASKED_S if changed and not resumed else float("inf")
    if history.was_asked_to(floor, within_s):
        return KEPT
    if not history.known or state.session_id not in history.asks:
        return None  # the request came before we listened, or another law reports the breach
    return Doubt(
        f"destination {shown(floor)}, which {shown(state.session_id)} did not ask for",
        lambda: history.was_asked_to(floor, within_s) or history.session != state.session_id,
    )


def unserved(history: LiftHistory) -> Finding:
    state = history.new
    if state is None or not state.available_floors:
        return None
    if state.destination_floor in ("", *state.available_floors):
        return KEPT if history.was_tested(history.unserved_at) else None
    return f"destination {shown(state.destination_floor)} is not one of its available_floors"


def lets_nobody_in(history: LiftHistory) -> Finding:
    """Check that the lift lets no robot in during a hazard. RMF lets a robot in only at the floor that
    the robot requests, so a robot elsewhere stays out (RequestLift.cpp)."""
    state = history.new
    if state is None or state.current_mode not in HAZARDS or not state.session_id:
        return None
    ask = history.asks.get(state.session_id)
    if history.offers and (ask is None or ask.floor == state.current_floor):
        return words.described(state) if ask else None
    return None if history.offered else KEPT


def _again(history: LiftHistory, state: d.LiftState) -> bool:
    """Return whether the state shows the session that had the lift last, and ended lately."""
    return state.session_id == history.last and history.now - history.last_at < GRACE_S + LATE_S


def grants_nothing(history: LiftHistory) -> Finding:
    """Check that no new session gets the lift during a hazard."""
    state, before = history.new, history.before
    if state is None or before is None or state.current_mode not in HAZARDS:
        return None
    new = state.session_id not in ("", before.session_id)
    if before.current_mode not in HAZARDS or _again(history, state):
        return None
    if new and state.current_mode == d.LiftMode.MODE_OFFLINE and _was_reached(state, before):
        return None  # the lift may have granted it in a state that was lost
    if not new:
        since = history.seen.mode.since.at
        tested = (
            since < ask.since and ask.direct and history.was_tested(ask.since)
            for ask in history.asks.values()
        )
        return KEPT if not history.session and any(tested) else None
    return f"granted in mode {words.word(d.LiftMode, state.current_mode)}: {words.described(state)}"


def _was_reached(state: d.LiftState, before: d.LiftState) -> bool:
    """Return whether the controller may have answered between the two states. A node that has reached
    it shows a newer reading. The stamp 0 tells nothing."""
    read_at = words.stamped_at(state)
    return read_at == 0.0 or read_at - words.stamped_at(before) > FROZEN_S


def no_false(history: LiftHistory) -> Finding:
    """Check that the lift's node publishes the end of an alarm (`false`) only after an alarm
    (`true`)."""
    if not isinstance(history.news, d.Bool) or history.others:
        return None
    if history.often(history.false_alarms):
        return "it sent `false` 3 times without an alarm before"
    return KEPT if history.called_off else None


def retained(history: LiftHistory) -> Finding:
    """Check that the alarm's publisher is TRANSIENT_LOCAL. Fleet adapters receive nothing from a
    volatile publisher."""
    if history.volatile is None or history.others:
        return None
    return (
        "its publisher is volatile, so fleet adapters do not receive its messages"
        if history.volatile
        else KEPT
    )


def blind(state: d.LiftState) -> bool:
    return state.current_mode in (d.LiftMode.MODE_OFFLINE, d.LiftMode.MODE_UNKNOWN)
