"""How each law of a lift is checked after a message. The laws themselves are in `lift_laws.py`."""

from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.observe.lift import HAZARDS
from workbench.judge.history import NOT_YET
from workbench.judge.law import KEPT, Doubt, Finding, shown
from workbench.judge.lift_history import GRACE_S, LATE_S, LiftScene

ENDS_WITHIN_S: Final = 3.0
"""A state period of 2 s, and one scan."""
GRANTS_WITHIN_S: Final = 30.0
GRANT_ASKED: Final = 10
JUMPS_WITHIN_S: Final = 1.5
REFUSED: Final = 3
FOREIGN_S: Final = 2.0
REOPENED: Final = 3
REOPENED_WITHIN_S: Final = 30.0
FALSE: Final = 3
FALSE_WITHIN_S: Final = 30.0
SETTLED_S: Final = 3.0
"""For this long after a node's first state it may still obey requests that we have not heard."""


def opened(state: d.LiftState) -> bool:
    return state.door_state == d.LiftDoor.DOOR_OPEN


def _is_open(scene: LiftScene) -> d.LiftState | None:
    state = scene.new
    return state if state is not None and opened(state) else None


def numbers(scene: LiftScene) -> Finding:
    state = scene.new
    if state is None:
        return None
    found = [
        f"{field} {value}"
        for field, value, known in (
            ("door_state", state.door_state, d.LiftDoor),
            ("motion_state", state.motion_state, d.LiftMotion),
            ("current_mode", state.current_mode, d.LiftMode),
            *(("available_modes", mode, d.LiftMode) for mode in state.available_modes[:20]),
        )
        if value not in list(known)
    ]
    return f"{', '.join(found[:3])}: RMF has no such number" if found else KEPT


def other_lift(scene: LiftScene) -> Finding:
    """The lift is not given to a session that only asked for another lift."""
    session = scene.session
    if scene.new is None or not session or session == scene.session_before:
        return None
    if session not in scene.elsewhere or scene.before is None:
        return KEPT
    return Doubt(
        f"held by {shown(session)}, which only asked for another lift",
        lambda: session in scene.asks,
    )


def own_name(scene: LiftScene) -> Finding:
    """The lift is not given to a session that did not ask."""
    session = scene.session
    if scene.new is None or scene.before is None or not session:
        return None
    if session == scene.session_before:
        return None
    if session in scene.asks or session in scene.elsewhere or scene.now - scene.since < SETTLED_S:
        return KEPT
    return Doubt(
        f"held by {shown(session)}, which never asked for it", lambda: session in scene.asks
    )


def grants(scene: LiftScene) -> Finding:
    """The first request on a free lift in service is granted."""
    if scene.new is None or scene.before is None:
        return None
    if scene.session:
        return KEPT if scene.session != scene.session_before else None
    free_s = scene.now - scene.free_since
    for session, ask in list(scene.asks.items()):
        asked = ask.direct and ask.times >= GRANT_ASKED and scene.now - ask.direct_at < 3.0
        served = ask.floors[-1] in scene.new.available_floors or not scene.new.available_floors
        long_s = min(free_s, scene.now - ask.since)
        if asked and served and session and not ask.human and long_s > GRANTS_WITHIN_S:
            return (
                f"{shown(session)} has asked {ask.times} times in {long_s:.0f} s; the lift is free"
            )
    return None


def bypassed(scene: LiftScene) -> Finding:
    """Requests of fleet adapters to the supervisor grant nothing."""
    session = scene.session
    if scene.new is None or scene.before is None or session in ("", scene.session_before):
        return None
    ask = scene.asks.get(session)
    if ask is None or ask.direct or scene.now - scene.other_asked_at > 10.0:
        return KEPT if ask else None

    def excused() -> bool:
        later = scene.asks.get(session)
        return later is not None and later.direct

    text = f"held by {shown(session)}, for which the supervisor has not asked"
    return Doubt(text, excused)


def ended_unasked(scene: LiftScene) -> Finding:
    """A session ends only by its own END."""
    old, new, since = scene.session_before, scene.session, scene.held_since
    if scene.new is None or scene.before is None or old in ("", new):
        return None
    ask = scene.asks.get(old)
    if scene.has_ended(old, since) or (ask and ask.human) or _foreign_end(scene, old, since):
        return KEPT
    what = f"session {shown(old)} became {shown(new)}" if new else f"session {shown(old)} ended"

    def excused() -> bool:
        return scene.has_ended(old, since) or bool(_foreign_end(scene, old, since))

    return Doubt(f"{what}, and no END_SESSION for it was heard", excused)


def _foreign_end(scene: LiftScene, session: str, since: float) -> str:
    """The session whose END has just come, if this session's has not come since then; "" for none."""
    if scene.has_ended(session, since):
        return ""
    others = (who for who in scene.ended if who not in ("", session))
    return next((who for who in others if scene.now - scene.ended[who] < FOREIGN_S), "")


def ended_by_another(scene: LiftScene) -> Finding:
    """The END of a session that does not have the lift changes nothing."""
    old = scene.session_before
    if scene.new is None or scene.before is None or not old:
        return None
    since = scene.granted_at if old == scene.session else scene.held_since
    other = _foreign_end(scene, old, since)
    if not other or old not in scene.asks:
        return None
    if old == scene.session:
        return KEPT
    text = f"END_SESSION of {shown(other)} ended the session of {shown(old)}"
    return Doubt(text, lambda: scene.has_ended(old, since))


def ends(scene: LiftScene) -> Finding:
    """The holder's END ends the session, whatever floor and door it names."""
    if scene.new is None:
        return None
    if scene.bare_refused >= REFUSED:
        return f"{REFUSED} sessions in a row outlived an END without a floor, as fleet adapters send it"
    if scene.session_before and scene.session != scene.session_before:
        return KEPT
    at = scene.ending.at
    if at == NOT_YET or scene.now - at < ENDS_WITHIN_S:
        return None
    bare = scene.ending.bare_at == at and scene.ending.floor_at == NOT_YET
    floor = " without a floor" if bare else ""
    return f"still held by {shown(scene.session)} {scene.now - at:.1f} s after its END{floor}"


def stopped(scene: LiftScene) -> Finding:
    state = _is_open(scene)
    if state is None:
        return None
    moving = state.motion_state in (d.LiftMotion.MOTION_UP, d.LiftMotion.MOTION_DOWN)
    return words.described(state) if moving else KEPT


def somewhere(scene: LiftScene) -> Finding:
    state = _is_open(scene)
    if state is None:
        return None
    return KEPT if state.current_floor else words.described(state)


def no_jump(scene: LiftScene) -> Finding:
    state = _is_open(scene)
    if state is None or not state.current_floor:
        return None
    floor, at = scene.open_seen
    if floor in ("", state.current_floor) or scene.now - at > JUMPS_WITHIN_S:
        return KEPT
    return (
        f"open at {shown(floor)}, and {scene.now - at:.1f} s later at {shown(state.current_floor)}"
    )


def in_agv(scene: LiftScene) -> Finding:
    """A robot is let in only while the car is not open to the public."""
    state = scene.new
    if state is None or not (scene.offers and scene.offered):
        return None
    if state.current_mode == d.LiftMode.MODE_HUMAN:
        return words.described(state)
    return KEPT if state.current_mode == d.LiftMode.MODE_AGV else None


def holds(scene: LiftScene) -> Finding:
    """The door stays open for the robot."""
    state = _is_open(scene)
    if state is None or not state.session_id or not scene.was_asked_to(state.current_floor):
        return None
    often = len(scene.reopened) == REOPENED
    if often and scene.now - scene.reopened[0] < REOPENED_WITHIN_S:
        return f"open, not open and open again within 1 s, {REOPENED} times in one stop"
    return KEPT


def floors(scene: LiftScene) -> Finding:
    state = scene.new
    if state is None or not state.available_floors:
        return None
    if state.current_floor in ("", *state.available_floors):
        return KEPT
    return f"current_floor {shown(state.current_floor)} is not one of its available_floors"


def destination(scene: LiftScene) -> Finding:
    """The car goes where its holder asked."""
    state = scene.new
    if state is None or not state.session_id or not state.destination_floor:
        return None
    if not scene.known or scene.was_asked_to(state.destination_floor):
        return KEPT
    if state.session_id not in scene.asks:
        return None  # another law says so
    floor = state.destination_floor
    return Doubt(
        f"destination {shown(floor)}, which {shown(state.session_id)} did not ask for",
        lambda: scene.was_asked_to(floor) or scene.session != state.session_id,
    )


def unserved(scene: LiftScene) -> Finding:
    state = scene.new
    if state is None or not state.available_floors or not state.destination_floor:
        return None
    if state.destination_floor in state.available_floors:
        return KEPT
    return f"destination {shown(state.destination_floor)} is not one of its available_floors"


def lets_nobody_in(scene: LiftScene) -> Finding:
    """Under a hazard no robot is let in."""
    state = scene.new
    if state is None or state.current_mode not in HAZARDS or not state.session_id:
        return None
    return words.described(state) if scene.offers else KEPT


def grants_nothing(scene: LiftScene) -> Finding:
    """Under a hazard no new session gets the lift."""
    state, before = scene.new, scene.before
    if state is None or before is None or state.current_mode not in HAZARDS:
        return None
    new = state.session_id not in ("", before.session_id)
    again = state.session_id == scene.last and scene.now - scene.last_at < GRACE_S + LATE_S
    if not new or again or before.current_mode not in HAZARDS:
        return KEPT if before.current_mode in HAZARDS else None
    return f"granted in mode {words.word(d.LiftMode, state.current_mode)}: {words.described(state)}"


def no_false(scene: LiftScene) -> Finding:
    """Only an operator calls an alarm off. With several lifts it is unknown which one published."""
    if not isinstance(scene.news, d.Bool) or scene.others:
        return None
    often = len(scene.false_alarms) == FALSE
    if often and scene.now - scene.false_alarms[0] < FALSE_WITHIN_S:
        return f"`false` {FALSE} times, with no alarm to call off"
    return KEPT


def retained(scene: LiftScene) -> Finding:
    """Fleets can hear the alarm."""
    if scene.volatile is None:
        return None
    return "its publisher is volatile: fleet adapters do not match it" if scene.volatile else KEPT


def blind(state: d.LiftState) -> bool:
    return state.current_mode in (d.LiftMode.MODE_OFFLINE, d.LiftMode.MODE_UNKNOWN)
