"""The outputs for a session, derived from its request and the inputs.

In AGV mode the lift's controller obeys our calls and door commands. The hold is the door command that
keeps the door open.

Rules:
LIFT-DRIVE-1. Without a session no output is switched on. All outputs are off under an obstacle
   (`core.py`), for a session in HUMAN mode, and between the tries after a fault. The outputs are also
   off if RMF is silent and the robot is outside. If AGV mode and the door's hold are on at END, they
   stay on for `release_grace_s`. The hold then ends `dead_time_s` before AGV mode.
LIFT-DRIVE-2. AGV mode comes first, then the call to the destination. The door's hold follows when the
   car stands at the destination. With `by_call` a call switches AGV mode on. The call then comes first,
   even if the car already stands at the destination.
LIFT-DRIVE-3. A call is given only if the car is not at the destination, and only without overload.
   Except with `by_call`, a call also needs AGV mode. A door command is given only in AGV mode, when the
   car stands at the destination's landing. A call and a door command are never on together. A call or a
   door command comes on only after all calls and door commands have been off for `dead_time_s`. That
   time begins at the first reading after the "off" was written.
LIFT-DRIVE-4. A call is held until the car stands at its destination. With `call_pulse_s` a call is a
   pulse. The pulse begins at the first reading after the call was written. The call is given again
   after every interruption. The call is also given again if the car had arrived and is later seen at
   another floor. No new call is given during a change of the floor code, because the car may be
   arriving at that moment.
LIFT-DRIVE-5. AGV mode, the arrival and the open door each have a timeout. When a timeout ends, the
   outputs go off and a fault is shown. Three retries follow, after 10, 30 and 60 s. If the last retry
   fails, the fault latches, which means that only an operator can clear it. If AGV mode ends during the
   ride, that is such a fault too. With `by_call` AGV mode may end between two destinations, when the
   call and the hold are off. During an overload no timeout runs.
LIFT-DRIVE-6. Switching off is immediate. A relay is switched on only after it has been off for
   `min_off_s`, and at most `max_cycles_per_min` times a minute (`Channel` in `relays.py`).
"""

from msgspec.structs import replace

from bridges.kinds.lift.memory import Grace, LiftLimits, LiftSession, Waiting
from bridges.kinds.lift.relays import Relays
from bridges.kinds.lift.sensing import BelievedLift
from bridges.kinds.lift.signals import Hazard, LiftOutputs
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import NEVER

RETRY_AFTER_S = (10.0, 30.0, 60.0)


def at_destination(session: LiftSession, view: BelievedLift, limits: LiftLimits) -> bool:
    """Return whether the car stands at the session's destination."""
    return view.stopped and _shows_destination(session, view, limits)


def is_not_seen_to_stand(session: LiftSession, view: BelievedLift, limits: LiftLimits) -> bool:
    """Return whether the car is at the destination, but its motion lines do not say that it stands."""
    return not view.stopped and _shows_destination(session, view, limits)


def _shows_destination(session: LiftSession, view: BelievedLift, limits: LiftLimits) -> bool:
    stop = limits.stops.get(session.destination)  # a session in HUMAN mode may have no destination
    return stop is not None and view.level == stop.level


def agv_ok(view: BelievedLift) -> bool:
    """Return whether AGV mode is on. Without a status line for AGV mode, assume that AGV mode is on."""
    return view.agv is not False


def silent(session: LiftSession, now: float, limits: LiftLimits) -> bool:
    """Return whether RMF's last request for this session is older than `request_timeout_s`."""
    return now >= session.asked_at + limits.t.request_timeout_s


def serves(session: LiftSession, allowed: bool, now: float, limits: LiftLimits) -> bool:
    """Return whether this session may have any output on. `allowed`: no obstacle is present."""
    outside_and_gone = silent(session, now, limits) and not session.boarded
    return allowed and session.agv and not outside_and_gone


def holds_later(session: LiftSession) -> bool:
    """Return whether the session will hold the door later: it waits for AGV mode, or for its next try.

    After a fault of AGV mode the next try may get no AGV mode, and then it cannot hold the door.
    """
    if session.fault and session.fault.code.startswith("AGV_MODE"):
        return False
    if session.retry_at is not None:
        return session.retry_at != NEVER
    return session.waiting == "agv"


def paused(session: LiftSession) -> LiftSession:
    """Interrupt the session's ride. The ride starts anew when outputs are allowed again."""
    return replace(session, agv_seen=False, arrived=False, call_at=None, waiting=None)


def advance(
    session: LiftSession, view: BelievedLift, relays: Relays, now: float, limits: LiftLimits
) -> LiftSession:
    """Update the session from this scan's inputs. Note arrivals, timeouts and retries.

    `relays`: the state of the relays before this scan.
    """
    if session.retry_at is not None:
        if now < session.retry_at:
            return session
        session = replace(session, retry_at=None)
    requested = _requested(session, relays, limits)
    if requested and session.agv_seen and not agv_ok(view):
        return _trip(session, Fault("AGV_MODE_LOST", "AGV mode ended during the ride"), now)
    session = replace(session, agv_seen=requested and view.agv is True)
    session = _arrive(session, view, limits)
    if Hazard.OVERLOAD in view.hazards:
        return replace(session, call_at=None, waiting=None)
    waiting = _waits_for(session, view, limits)
    if waiting != session.waiting:
        session = replace(session, waiting=waiting, since=now)
    if waiting is None:
        return replace(session, tries=0, fault=None)
    if now >= session.since + _time_for(waiting, limits):
        return _trip(session, _timeout_fault(session, waiting, view, limits), now)
    return session


def wanted(
    session: LiftSession, view: BelievedLift, relays: Relays, now: float, limits: LiftLimits
) -> LiftOutputs:
    """Choose the outputs for a session that may have outputs (`serves`).

    `relays`: the state of the relays before this scan.
    """
    if session.retry_at is not None:
        return LiftOutputs()
    if not (agv_ok(view) or limits.by_call):
        return LiftOutputs(agv_request=True)
    stop = limits.stops[session.destination]
    if agv_ok(view) and at_destination(session, view, limits):
        return LiftOutputs(agv_request=True, hold_door=stop.side)
    may_call = not session.arrived and now < _pulse_ends_at(session, limits)
    is_new_call = session.call_at is None and relays.call.on != stop.level
    if not may_call or Hazard.OVERLOAD in view.hazards or (is_new_call and view.level_settles):
        return LiftOutputs(agv_request=True)
    return LiftOutputs(agv_request=True, call=stop.level)


def stays_on(
    grace: Grace, relays: Relays, view: BelievedLift, now: float, limits: LiftLimits
) -> LiftOutputs:
    """Choose the outputs for the grace, which is the time after END in which outputs may stay on."""
    if now >= grace.off_at:
        return LiftOutputs()
    standing = agv_ok(view) and at_destination(grace.session, view, limits)
    hold = relays.hold.on if standing and now < let_go_at(grace, limits) else None
    return LiftOutputs(agv_request=bool(relays.agv.on), hold_door=hold)


def let_go_at(grace: Grace, limits: LiftLimits) -> float:
    """Return the time when the door's hold ends during the grace."""
    return min(grace.off_at, grace.until) - limits.t.dead_time_s


def next_at(session: LiftSession, limits: LiftLimits) -> tuple[float, ...]:
    """Return the times when this session's outputs or report may change without an event."""
    waits = NEVER if session.waiting is None else session.since + _time_for(session.waiting, limits)
    return (
        session.asked_at + limits.t.request_timeout_s,
        NEVER if session.retry_at is None else session.retry_at,
        waits,
        _pulse_ends_at(session, limits),
    )


def _requested(session: LiftSession, relays: Relays, limits: LiftLimits) -> bool:
    """Return whether our outputs requested AGV mode before this scan."""
    if limits.by_call:
        called = session.call_at is not None or relays.call.on is not None
        return called or relays.hold.on is not None
    return bool(relays.agv.on)


def _arrive(session: LiftSession, view: BelievedLift, limits: LiftLimits) -> LiftSession:
    """End the call when the car stands at the destination. Call again if the car is later seen at
    another floor.

    With `by_call`, AGV mode must be on before a call ends, even if the car already stands at the
    destination.
    """
    if limits.by_call and not agv_ok(view):
        return replace(session, arrived=False)
    if at_destination(session, view, limits):
        return replace(session, arrived=True)
    elsewhere = view.level not in (None, limits.stops[session.destination].level)
    if session.arrived and elsewhere:
        return replace(session, arrived=False, call_at=None)
    return session


def _waits_for(session: LiftSession, view: BelievedLift, limits: LiftLimits) -> Waiting | None:
    if not agv_ok(view):
        return "agv"
    if not at_destination(session, view, limits):
        return "floor"
    return None if view.door(limits.side(session.destination)).open else "door"


def _time_for(waiting: Waiting, limits: LiftLimits) -> float:
    t = limits.t
    return {"agv": t.agv_timeout_s, "floor": t.floor_timeout_s, "door": t.door_timeout_s}[waiting]


def _timeout_fault(
    session: LiftSession, waiting: Waiting, view: BelievedLift, limits: LiftLimits
) -> Fault:
    after = f"after {_time_for(waiting, limits):g} s"
    if waiting == "agv":
        return Fault("AGV_MODE_NOT_GRANTED", f"no AGV mode status {after}")
    if waiting == "floor":
        seen = "not seen to stand" if is_not_seen_to_stand(session, view, limits) else "not"
        return Fault("RUNTIME_LIMIT_EXCEEDED", f"{seen} at {session.destination} {after}")
    return Fault("DOOR_OPENING_FAULT", f"not open at {session.destination} {after}")


def _trip(session: LiftSession, fault: Fault, now: float) -> LiftSession:
    """Switch the outputs off until the next try. After the third retry the fault latches."""
    latched = session.tries >= len(RETRY_AFTER_S)
    retry_at = NEVER if latched else now + RETRY_AFTER_S[session.tries]
    return replace(paused(session), tries=session.tries + 1, retry_at=retry_at, fault=fault)


def _pulse_ends_at(session: LiftSession, limits: LiftLimits) -> float:
    """Return the time when a call's pulse ends; NEVER for a held call."""
    if session.call_at is None or limits.t.call_pulse_s is None:
        return NEVER
    return session.call_at + limits.t.call_pulse_s
