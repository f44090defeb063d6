"""The lift's sessions: grants, refusals, END, and the time after END (the grace).

The rules are in three files: `core.py` (LIFT-1, LIFT-2), `forgotten.py` (sessions that RMF's supervisor
forgets) and `replayed.py` (replayed requests).
"""

from collections.abc import Callable
from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift import forgotten, replayed
from bridges.kinds.lift.memory import Grace, LiftLimits, LiftMemory, LiftSession
from bridges.kinds.lift.signals import EndRequested, LiftRequested
from bridges.kinds.shared.decision import RELEASED_LATELY
from bridges.kinds.shared.durations import AGES_AGO

LEFT_IN_CAR: Final = "released in mid-ride"


def ask(
    memory: LiftMemory, request: LiftRequested, now: float, why_not: Callable[[], str]
) -> tuple[LiftMemory, str]:
    """Apply a request from `lift_requests`. Also return the reason for a refusal, "" if there is none.

    `why_not()` returns the obstacle that forbids a grant of the free lift.
    """
    held, grace = memory.session, memory.grace
    if held and held.id != request.session_id:
        session = forgotten.overruled(held, request.session_id, now)
        return replace(memory, session=session), f"held by another session: {held.id}"
    if held:
        return replace(memory, session=_heed(memory, held, request, now)), ""
    if grace and now < grace.until:
        if grace.session.id != request.session_id:
            waits = LEFT_IN_CAR if grace.in_car else RELEASED_LATELY
            return memory, f"{waits}: by {grace.session.id}"
        session = forgotten.granted(_anew(grace.session, now), request.stamp)
        return replace(memory, session=_heed(memory, session, request, now), grace=None), ""
    if refused := why_not():
        return memory, refused
    session = LiftSession(request.session_id, request.agv, request.destination, now)
    return replace(memory, session=forgotten.granted(session, request.stamp), grace=None), ""


def _heed(
    memory: LiftMemory, session: LiftSession, request: LiftRequested, now: float
) -> LiftSession:
    """Apply a request from `lift_requests` to the session that has the lift."""
    own = memory.own.get(session.id, "")
    held_open = memory.relays.hold.on is not None
    doubted = replayed.doubt(session, request, own, held_open, now)
    heeded = replace(session, asked_at=now) if doubted else _refresh(session, request, now)
    return replace(heeded, forgotten=None, doubted=doubted)


def hear_adapter(
    memory: LiftMemory, asked: LiftRequested | EndRequested, now: float, limits: LiftLimits
) -> LiftMemory:
    """Apply a request that a robot's own fleet adapter sent. The request counts in three cases:

    - The robot has the lift, and RMF's supervisor has forgotten or disowned its session.
    - The request confirms a destination of the session that was in doubt.
    - The robot was left in the car.
    """
    held = memory.session
    memory = replace(memory, own=replayed.noted(memory.own, asked))
    if held is None:
        return _come_back(memory, asked, now)
    if held.id != asked.session_id:
        return memory
    session, obeyed = forgotten.heard(held, asked, now)
    if not (obeyed or replayed.confirmed(session, asked)):
        return replace(memory, session=session)
    if isinstance(asked, LiftRequested):
        return replace(memory, session=_refresh(session, asked, now))
    return _let_go(memory, session, asked.by_person, now, limits)


def _come_back(memory: LiftMemory, asked: LiftRequested | EndRequested, now: float) -> LiftMemory:
    """Restore the session of a robot that may have been left in the car. The robot must ask before the
    grace, which is the time after END, is over."""
    grace = memory.grace
    if grace is None or not grace.in_car or now >= grace.until:
        return memory
    if grace.session.id != asked.session_id:
        return memory
    session = forgotten.heard(grace.session, asked, now)[0]
    before, robot = grace.session.robot, session.robot
    counts = (robot.stamp, robot.asked_at) != (before.stamp, before.asked_at)
    if isinstance(asked, EndRequested) or not counts:
        return replace(memory, grace=replace(grace, session=session))
    session = _refresh(forgotten.disowned(_anew(session, now), now), asked, now)
    return replace(memory, session=session, grace=None)


def _refresh(session: LiftSession, request: LiftRequested, now: float) -> LiftSession:
    """Refresh the session at a repeated request. Start the ride anew at a request for another
    destination or mode."""
    if (request.agv, request.destination) == (session.agv, session.destination):
        return replace(session, asked_at=now)
    fresh = replace(_anew(session, now), agv=request.agv, destination=request.destination)
    return replace(fresh, forgotten=session.forgotten)


def _anew(session: LiftSession, now: float) -> LiftSession:
    """Return the session as if it were granted now. Keep what is known about its robot."""
    return LiftSession(
        session.id,
        session.agv,
        session.destination,
        now,
        boarded=session.boarded,
        robot=session.robot,
        ends=session.ends,
    )


def end(
    memory: LiftMemory, ended: EndRequested, now: float, limits: LiftLimits
) -> tuple[LiftMemory, str]:
    """Apply an END from `lift_requests`. Also return the reason for a refusal, "" if there is none."""
    held, grace = memory.session, memory.grace
    if held is None and grace and ended.by_person and ended.session_id == grace.session.id:
        return replace(memory, grace=replace(grace, until=grace.off_at, in_car=False)), ""
    if held is None or not ended.session_id:
        return memory, ""
    if held.id != ended.session_id:
        session = forgotten.remembered(held, ended.session_id)
        return replace(memory, session=session), f"held by another session: {held.id}"
    session, counts = forgotten.counts(held, ended, now)
    if not counts:
        return replace(memory, session=session), f"END older than the session: {held.id}"
    if forgotten.goes_on(session, now) and not ended.by_person:
        return replace(memory, session=forgotten.disowned(session, now)), ""
    return _let_go(memory, session, ended.by_person, now, limits), ""


def lapse(memory: LiftMemory, now: float, limits: LiftLimits) -> LiftMemory:
    """End a session that RMF's supervisor has ended (disowned), because its robot is now silent too."""
    held = memory.session
    if held is None or now < forgotten.lapses_at(held):
        return memory
    return _let_go(memory, held, False, now, limits)


def _let_go(
    memory: LiftMemory, held: LiftSession, by_person: bool, now: float, limits: LiftLimits
) -> LiftMemory:
    """End the session, and begin its grace."""
    grace = None
    if memory.relays.agv.on or held.boarded:
        off_at = now + limits.t.release_grace_s
        in_car_until = AGES_AGO if by_person else forgotten.in_car_until(held, now)
        grace = Grace(held, max(off_at, in_car_until), off_at, in_car_until > now)
    return replace(memory, session=None, grace=grace)
