"""What the lift's outputs should be: from who holds the lift, what is seen, and what was asked.

Rules:
- Nothing is newly energised without a session, and nothing at all under an obstacle (`core.py`), for
  a session in HUMAN mode, while RMF is silent with the robot outside, or while a fault waits for its
  next try. After END, for the grace, AGV mode and the door's hold stay as far as they are on; the
  hold ends `dead_time_s` before AGV mode.
- AGV mode first; then the call to the destination; then, standing there, the door.
- A call only in AGV mode, away from the destination, not while overloaded. A door command only while
  standing at the destination's landing. Never both; and neither within `dead_time_s` of the last one.
- A call is held until the car stands at its destination, or pulsed; it is given again when the car is
  seen at another floor after it had arrived, and after every interruption; never for a floor code
  that is just changing, which may say that the car is there.
- What is waited for (AGV mode, the floor, the open door) has its time; when it is up the outputs go
  off and a fault is shown; three more tries follow 10, 30 and 60 s later; then the fault latches.
  So does AGV mode that ends while we ask for it. An overload only stops the clock.
- Off is immediate. On waits for `min_off_s` and for the relay's cycles of the last minute.
"""

import math
from typing import Generic, Literal, TypeVar

import msgspec
from msgspec.structs import replace

from bridges.core.decision import Fault
from bridges.lift.limits import LiftLimits
from bridges.lift.sensing import View
from bridges.lift.signals import Hazard, LiftOutputs, Side

T = TypeVar("T")
NEVER = float("inf")
RETRY_AFTER_S = (10.0, 30.0, 60.0)
Waiting = Literal["agv", "floor", "door"]


class Session(msgspec.Struct, frozen=True):
    """Who holds the lift, what they asked, and how far we are with it.

    `boarded`: an open door at the destination has been published for this session: a robot may be
    inside. `agv_seen`: AGV mode is on for our request. `arrived`: the car stood at the destination.
    `call_at`: when the present call began. `waiting`, `since`: what we wait for. `tries`: how often
    that has failed; `retry_at`: outputs stay off until then (inf: latched).
    """

    id: str
    agv: bool
    destination: str
    asked_at: float
    boarded: bool = False
    agv_seen: bool = False
    arrived: bool = False
    call_at: float | None = None
    waiting: Waiting | None = None
    since: float = 0.0
    tries: int = 0
    retry_at: float | None = None
    fault: Fault | None = None


class Grace(msgspec.Struct, frozen=True):
    """After END: whose return is awaited, with what may stay on meanwhile, until when."""

    session: Session
    until: float


class Channel(msgspec.Struct, Generic[T], frozen=True):
    """One output or one group of exclusive ones: what is on, since when off, recent switchings on."""

    on: T | None = None
    off_at: float = -NEVER
    ons: tuple[float, ...] = ()

    def step(
        self, wanted: T | None, now: float, ready_at: float, limits: LiftLimits
    ) -> "Channel[T]":
        """The next state: off at once, on when wear and `ready_at` allow, changed by way of off."""
        if self.on is not None:
            return self if wanted == self.on else replace(self, on=None, off_at=now)
        if wanted is None or now < self.may_switch_on_at(now, ready_at, limits):
            return self
        return Channel(wanted, self.off_at, (*self.recent(now), now))

    def recent(self, now: float) -> tuple[float, ...]:
        """When it was switched on during the last minute."""
        return tuple(at for at in self.ons if now - at < 60.0)

    def may_switch_on_at(self, now: float, ready_at: float, limits: LiftLimits) -> float:
        """The earliest time at which it may be energised."""
        recent = self.recent(now)
        most = limits.t.max_cycles_per_min
        rested_at = recent[-most] + 60.0 if len(recent) >= most else -NEVER
        return max(self.off_at + limits.t.min_off_s, ready_at, rested_at)


class Relays(msgspec.Struct, frozen=True):
    """Every output with its history. A call and a door command exclude each other in time."""

    agv: Channel[bool] = Channel()
    call: Channel[str] = Channel()
    hold: Channel[Side] = Channel()

    def outputs(self) -> LiftOutputs:
        """What the driver is to write."""
        return LiftOutputs(bool(self.agv.on), self.call.on, self.hold.on)

    def step(self, wanted: LiftOutputs, now: float, limits: LiftLimits) -> "Relays":
        """Move every output towards what is wanted, as far as is allowed now."""
        agv = self.agv.step(wanted.agv_request or None, now, -NEVER, limits)
        rested_at = self._rested_at(limits) if agv.on else NEVER
        call_ready_at = NEVER if self.hold.on else rested_at
        call = self.call.step(wanted.call, now, call_ready_at, limits)
        hold_ready_at = NEVER if self.call.on or call.on else rested_at
        hold = self.hold.step(wanted.hold_door, now, hold_ready_at, limits)
        return Relays(agv, call, hold)

    def changes_at(self, wanted: LiftOutputs, now: float, limits: LiftLimits) -> float:
        """When an output that is wanted and still off may come on; always later than `now`."""
        agv_at = now if self.agv.on else self.agv.may_switch_on_at(now, -NEVER, limits)
        ready_at = max(agv_at, self._rested_at(limits))
        due = []
        if wanted.agv_request and not self.agv.on:
            due.append(agv_at)
        if wanted.call and not self.call.on:
            due.append(self.call.may_switch_on_at(now, ready_at, limits))
        if wanted.hold_door and not self.hold.on:
            due.append(self.hold.may_switch_on_at(now, ready_at, limits))
        return max(min(due, default=NEVER), math.nextafter(now, NEVER))

    def _rested_at(self, limits: LiftLimits) -> float:
        """When neither call nor door command has been on for `dead_time_s`."""
        return max(self.call.off_at, self.hold.off_at) + limits.t.dead_time_s


def at_destination(session: Session, view: View, limits: LiftLimits) -> bool:
    """Does the car stand at the landing that the session asked for?"""
    return view.stopped and view.level == limits.stops[session.destination].level


def agv_ok(view: View) -> bool:
    """AGV mode is on as far as the wiring can tell (True where no status line is wired)."""
    return view.agv is not False


def silent(session: Session, now: float, limits: LiftLimits) -> bool:
    """RMF has not repeated its request for too long."""
    return now >= session.asked_at + limits.t.request_timeout_s


def serves(session: Session, allowed: bool, now: float, limits: LiftLimits) -> bool:
    """May anything be energised for this session? `allowed`: nothing forbids it to everybody."""
    outside_and_gone = silent(session, now, limits) and not session.boarded
    return allowed and session.agv and not outside_and_gone


def paused(session: Session) -> Session:
    """Outputs are off for another reason than a failure of the lift's: later it starts afresh."""
    return replace(session, agv_seen=False, arrived=False, call_at=None, waiting=None)


def advance(
    session: Session, view: View, requested: bool, now: float, limits: LiftLimits
) -> Session:
    """Bring the progress of a session that is served up to what is seen: arrivals, waits, retries.

    `requested`: AGV mode has been asked of the lift until now.
    """
    if session.retry_at is not None:
        if now < session.retry_at:
            return session
        session = replace(session, retry_at=None)
    if session.agv_seen and not agv_ok(view):
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
        return _trip(session, _timeout_fault(session, waiting, limits), now)
    return session


def wanted(session: Session, view: View, now: float, limits: LiftLimits) -> LiftOutputs:
    """The outputs for a session that is served."""
    if session.retry_at is not None:
        return LiftOutputs()
    if not agv_ok(view):
        return LiftOutputs(agv_request=True)
    stop = limits.stops[session.destination]
    if at_destination(session, view, limits):
        return LiftOutputs(agv_request=True, hold_door=stop.side)
    may_call = not session.arrived and now < _pulse_ends_at(session, limits)
    is_new_call = session.call_at is None
    if not may_call or Hazard.OVERLOAD in view.hazards or (is_new_call and view.level_settles):
        return LiftOutputs(agv_request=True)
    return LiftOutputs(agv_request=True, call=stop.level)


def kept(grace: Grace, relays: Relays, view: View, now: float, limits: LiftLimits) -> LiftOutputs:
    """After END: what stays on."""
    standing = agv_ok(view) and at_destination(grace.session, view, limits)
    hold = relays.hold.on if standing and now < let_go_at(grace, limits) else None
    return LiftOutputs(agv_request=bool(relays.agv.on), hold_door=hold)


def let_go_at(grace: Grace, limits: LiftLimits) -> float:
    """When the door's hold ends."""
    return grace.until - limits.t.dead_time_s


def next_at(session: Session, limits: LiftLimits) -> tuple[float, ...]:
    """When time alone may change what this session wants or shows."""
    waits = NEVER if session.waiting is None else session.since + _time_for(session.waiting, limits)
    return (
        session.asked_at + limits.t.request_timeout_s,
        NEVER if session.retry_at is None else session.retry_at,
        waits,
        _pulse_ends_at(session, limits),
    )


def _arrive(session: Session, view: View, limits: LiftLimits) -> Session:
    """Standing at the destination ends the call; seen at another floor, the car is called anew."""
    if at_destination(session, view, limits):
        return replace(session, arrived=True)
    elsewhere = view.level not in (None, limits.stops[session.destination].level)
    if session.arrived and elsewhere:
        return replace(session, arrived=False, call_at=None)
    return session


def _waits_for(session: Session, view: View, limits: LiftLimits) -> Waiting | None:
    if not agv_ok(view):
        return "agv"
    if not at_destination(session, view, limits):
        return "floor"
    return None if view.door(limits.side(session.destination)).open else "door"


def _time_for(waiting: Waiting, limits: LiftLimits) -> float:
    t = limits.t
    return {"agv": t.agv_timeout_s, "floor": t.floor_timeout_s, "door": t.door_timeout_s}[waiting]


def _timeout_fault(session: Session, waiting: Waiting, limits: LiftLimits) -> Fault:
    after = f"after {_time_for(waiting, limits):g} s"
    if waiting == "agv":
        return Fault("AGV_MODE_NOT_GRANTED", f"no AGV mode status {after}")
    if waiting == "floor":
        return Fault("RUNTIME_LIMIT_EXCEEDED", f"not at {session.destination} {after}")
    return Fault("DOOR_OPENING_FAULT", f"not open at {session.destination} {after}")


def _trip(session: Session, fault: Fault, now: float) -> Session:
    """Outputs off for a while; for good after the third retry."""
    latched = session.tries >= len(RETRY_AFTER_S)
    retry_at = NEVER if latched else now + RETRY_AFTER_S[session.tries]
    return replace(paused(session), tries=session.tries + 1, retry_at=retry_at, fault=fault)


def _pulse_ends_at(session: Session, limits: LiftLimits) -> float:
    """When a pulsed call ends; NEVER for one that is held."""
    if session.call_at is None or limits.t.call_pulse_s is None:
        return NEVER
    return session.call_at + limits.t.call_pulse_s
