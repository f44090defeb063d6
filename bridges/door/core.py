"""What a door does and says: one pure decision for each event.

Rules:
- OPEN latches the hold, whoever asks and however often. CLOSE lets it go after `close_grace_s`,
  which an OPEN cancels and a repeated CLOSE does not prolong: RMF's supervisor, restarted while a
  robot stands in the doorway, first sends a CLOSE. Nothing ever drives the door shut, and silence
  never lets go: RMF is silent while a robot passes.
- After our hold has ended and until the door is seen closed, an obstruction takes hold again.
- A fire alarm does what the site chose. `open` holds the door against every CLOSE. `release` lets it
  go, forgets the latch and refuses OPEN; the state is then UNKNOWN, so that no robot enters a door
  that is about to close, and RMF's supervisor stops its reminders.
- Without a fresh reading the state is OFFLINE and the hold off; the latch is kept, and asserted
  again with the first good reading.
- OPEN is what the contact of the fully open door says, and nothing else. Both contacts: UNKNOWN.
  Neither: MOVING, and after `travel_s` UNKNOWN. A controller that does not say: UNKNOWN.
- While somebody else publishes states under this door's name: OFFLINE and the hold off.

Faults here describe, and change nothing that is driven: each lasts as long as its cause, so there is
none for an operator to reset.
"""

from collections.abc import Iterator
from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.core.decision import (
    Decision,
    Fault,
    IoFailed,
    OperatorReset,
    RivalSeen,
    Sampled,
    WriteFailed,
)
from bridges.door.sensing import NEVER, Senses, View, look, miss, take
from bridges.door.settings import DoorLimits, Pulse
from bridges.door.signals import DoorOutputs, DoorSample
from bridges.rmf.definitions import DoorModeValue

RIVAL_QUIET_S = 5.0
"""How long no rival must have been heard before the door is ours again."""


class OpenDoor(msgspec.Struct, frozen=True):
    """Somebody wants the door open. Who, is for the log only."""

    requester_id: str


class CloseDoor(msgspec.Struct, frozen=True):
    """Nobody wants the door open any longer, says this requester."""

    requester_id: str


Event = Sampled[DoorSample] | IoFailed | RivalSeen | OperatorReset | OpenDoor | CloseDoor


class DoorMemory(msgspec.Struct, frozen=True):
    """Everything that the next decision needs to know of the past. Times are monotonic seconds.

    `latched_at`: RMF wants the door open since then. `close_at`: when a CLOSE becomes true.
    `held_since`: since when the hold has been as `held` says. `closing`: our hold has ended and the
    door has not been seen closed since. `between_since`, `shut_since`: since when neither limit, and
    not the open one, has been believed.
    """

    latched_at: float | None = None
    close_at: float | None = None
    held: bool = False
    held_since: float = 0.0
    closing: bool = False
    senses: Senses = Senses()
    between_since: float | None = None
    shut_since: float | None = None
    rival_at: float | None = None
    io_failure: str = ""


class DoorReport(msgspec.Struct, frozen=True):
    """What RMF and the status file are told. `hold`: we hold the door open (pulses included).

    `estimated`: no contact proves `mode`.
    """

    mode: DoorModeValue
    read_at: float | None = None
    faults: tuple[Fault, ...] = ()
    hold: bool = False
    estimated: bool = False

    def news(self) -> Any:
        """The report without its age."""
        return self.mode, self.faults, self.hold, self.estimated


def initial(limits: DoorLimits, now: float) -> DoorMemory:
    """At start: nothing is known, nothing is held."""
    return DoorMemory(held_since=now)


def decide(
    memory: DoorMemory, event: Event, now: float, limits: DoorLimits
) -> Decision[DoorMemory, DoorOutputs, DoorReport]:
    """One scan. `now`: monotonic s, never before that of the last scan. Never raises."""
    memory, refused = _hear(memory, event, now, limits)
    memory = _let_go(memory, now)
    memory = _hold(memory, _look(memory, now, limits), now, limits)
    view = _look(memory, now, limits)
    is_on = _pulse_is_on(memory, now, limits.pulse)
    return Decision(
        memory=memory,
        outputs=DoorOutputs(memory.held and is_on, between_pulses=memory.held and not is_on),
        report=_report(memory, view, now, limits),
        wake_at=min((at for at in _wakes(memory, view, now, limits) if at > now), default=NEVER),
        refused=refused,
    )


def _hear(
    memory: DoorMemory, event: Event, now: float, limits: DoorLimits
) -> tuple[DoorMemory, str]:
    match event:
        case Sampled(sample):
            senses = take(memory.senses, sample, now, limits)
            return replace(memory, senses=senses, io_failure=""), ""
        case WriteFailed(reason):
            senses = replace(memory.senses, linked_since=None)
            return replace(memory, senses=senses, io_failure=reason), ""
        case IoFailed(reason):
            return replace(memory, senses=miss(memory.senses), io_failure=reason), ""
        case RivalSeen():
            return replace(memory, rival_at=now), ""
        case OpenDoor():
            return _open(memory, now, limits)
        case CloseDoor():
            return _close(memory, now, limits), ""
    return memory, ""  # an operator's reset: nothing here latches


def _open(memory: DoorMemory, now: float, limits: DoorLimits) -> tuple[DoorMemory, str]:
    if _released_by_fire(_look(memory, now, limits), limits):
        return memory, "the fire alarm has released the door"
    latched_at = now if memory.latched_at is None else memory.latched_at
    return replace(memory, latched_at=latched_at, close_at=None), ""


def _close(memory: DoorMemory, now: float, limits: DoorLimits) -> DoorMemory:
    if memory.latched_at is None or memory.close_at is not None:
        return memory
    return replace(memory, close_at=now + limits.t.close_grace_s)


def _let_go(memory: DoorMemory, now: float) -> DoorMemory:
    if memory.close_at is None or now < memory.close_at:
        return memory
    return replace(memory, latched_at=None, close_at=None)


def _look(memory: DoorMemory, now: float, limits: DoorLimits) -> View:
    return look(memory.senses, memory.held, memory.held_since, now, limits)


def _released_by_fire(view: View, limits: DoorLimits) -> bool:
    return view.fresh and view.fire and limits.on_fire == "release"


def _rivalled(memory: DoorMemory, now: float) -> bool:
    return memory.rival_at is not None and now < memory.rival_at + RIVAL_QUIET_S


def _hold(memory: DoorMemory, view: View, now: float, limits: DoorLimits) -> DoorMemory:
    """Is the hold on? And what has to be remembered to decide it next time."""
    if _released_by_fire(view, limits):
        memory = replace(memory, latched_at=None, close_at=None)
    able = view.fresh and not _rivalled(memory, now)
    wanted = able and _wanted(memory, view, limits)
    shut = view.seen and view.closed and not view.lost
    closing = (memory.closing or (memory.held and not wanted)) and not shut
    held = wanted or (able and closing and view.obstructed and not view.fire)
    return replace(
        memory,
        held=held,
        held_since=now if held != memory.held else memory.held_since,
        closing=closing,
        between_since=_since(
            memory.between_since, view.seen and not (view.opened or view.closed or view.lost), now
        ),
        shut_since=_since(memory.shut_since, view.seen and not view.opened, now),
    )


def _wanted(memory: DoorMemory, view: View, limits: DoorLimits) -> bool:
    if view.fire:
        return limits.on_fire == "open"
    return memory.latched_at is not None


def _since(before: float | None, is_so: bool, now: float) -> float | None:
    if not is_so:
        return None
    return now if before is None else before


def _pulse_is_on(memory: DoorMemory, now: float, pulse: Pulse | None) -> bool:
    return pulse is None or (now - memory.held_since) % pulse.every_s < pulse.on_s


def _travel_ends_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """When a door between its limits has been there for too long; turning round starts again."""
    if memory.between_since is None:
        return NEVER
    return max(memory.between_since, memory.held_since) + limits.t.travel_s


def _opening_ends_at(memory: DoorMemory, limits: DoorLimits) -> float:
    if memory.shut_since is None or not memory.held:
        return NEVER
    return max(memory.shut_since, memory.held_since) + limits.t.open_timeout_s


def _too_long_at(memory: DoorMemory, limits: DoorLimits) -> float:
    if memory.latched_at is None or limits.t.max_hold_s is None:
        return NEVER
    return memory.latched_at + limits.t.max_hold_s


def _report(memory: DoorMemory, view: View, now: float, limits: DoorLimits) -> DoorReport:
    mode = _mode(memory, view, now, limits)
    return DoorReport(
        mode=mode,
        read_at=memory.senses.read_at,
        faults=tuple(_faults(memory, view, now, limits)),
        hold=memory.held,
        estimated=bool(view.estimated & _PROOFS.get(mode, frozenset())),
    )


_PROOFS = {
    DoorModeValue.MODE_OPEN: frozenset({"opened"}),
    DoorModeValue.MODE_CLOSED: frozenset({"closed"}),
    DoorModeValue.MODE_MOVING: frozenset({"opened", "closed"}),
}
"""The contacts that a mode rests on."""


def _mode(memory: DoorMemory, view: View, now: float, limits: DoorLimits) -> DoorModeValue:
    if _rivalled(memory, now) or not view.fresh:
        return DoorModeValue.MODE_OFFLINE
    if not view.seen or _released_by_fire(view, limits):
        return DoorModeValue.MODE_UNKNOWN
    if view.lost or (view.opened and view.closed):
        return DoorModeValue.MODE_UNKNOWN
    if view.opened:
        return DoorModeValue.MODE_OPEN
    if view.closed:
        return DoorModeValue.MODE_CLOSED
    if now >= _travel_ends_at(memory, limits):
        return DoorModeValue.MODE_UNKNOWN
    return DoorModeValue.MODE_MOVING


def _faults(memory: DoorMemory, view: View, now: float, limits: DoorLimits) -> Iterator[Fault]:
    """Everything that is wrong now, most serious first. No text has a number that runs."""
    if _rivalled(memory, now):
        yield Fault("TWO_NODES_FOR_ONE_DEVICE", "another node publishes states of this door")
    if not view.fresh:
        yield from _silence(memory, limits)
    else:
        yield from _hazards(memory, view, limits)
        yield from _contradictions(memory, view, now, limits)
    if now >= _too_long_at(memory, limits):
        yield Fault("DOOR_OPEN_TOO_LONG", f"held for RMF longer than {limits.t.max_hold_s} s")


def _silence(memory: DoorMemory, limits: DoorLimits) -> Iterator[Fault]:
    if memory.io_failure:
        yield Fault("COMMUNICATION_LOST", memory.io_failure)
    elif memory.senses.read_at is not None:
        yield Fault("COMMUNICATION_LOST", f"no reading for {limits.t.stale_after_s} s")


def _hazards(memory: DoorMemory, view: View, limits: DoorLimits) -> Iterator[Fault]:
    if view.fire:
        done = "held open" if limits.on_fire == "open" else "released"
        yield Fault("FIRE_ALARM", f"the door is {done}")
    if memory.closing and memory.held and memory.latched_at is None and view.obstructed:
        yield Fault("DOOR_OBSTRUCTED", "held open after CLOSE while the doorway is not clear")
    if view.errors:
        yield Fault("DOOR_CONTROLLER_FAULT", "; ".join(view.errors))


def _contradictions(
    memory: DoorMemory, view: View, now: float, limits: DoorLimits
) -> Iterator[Fault]:
    if view.seen and view.opened and view.closed:
        yield Fault("DOOR_CONTACTS_CONTRADICT", "the door reads opened and closed")
    if view.lost:
        yield Fault("DOOR_POSITION_UNKNOWN", view.lost)
    if now >= _travel_ends_at(memory, limits):
        yield Fault("DOOR_TRAVEL_TIMEOUT", f"at neither limit for {limits.t.travel_s} s")
    if now >= _opening_ends_at(memory, limits):
        yield Fault("DOOR_OPENING_FAULT", f"held, but not open after {limits.t.open_timeout_s} s")


def _wakes(memory: DoorMemory, view: View, now: float, limits: DoorLimits) -> Iterator[float]:
    """Every time at which something would be decided differently."""
    yield view.changes_at
    yield NEVER if memory.close_at is None else memory.close_at
    yield NEVER if memory.rival_at is None else memory.rival_at + RIVAL_QUIET_S
    yield _travel_ends_at(memory, limits)
    yield _opening_ends_at(memory, limits)
    yield _too_long_at(memory, limits)
    if memory.held and limits.pulse is not None:
        phase_s = (now - memory.held_since) % limits.pulse.every_s
        is_on = phase_s < limits.pulse.on_s
        yield now - phase_s + (limits.pulse.on_s if is_on else limits.pulse.every_s)
