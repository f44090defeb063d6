"""The door's decision core: one pure decision for each event.

The hold is the output that opens the door and keeps it open. For a door operator that closes the door
by itself, `pulses.py` gives the hold in pulses.

Rules:
DOOR-1. An OPEN from any requester switches the hold on until a CLOSE comes (the latch). A repeated OPEN
   is harmless. A CLOSE releases the hold after `close_grace_s`. An OPEN within that time cancels the
   CLOSE. A repeated CLOSE does not prolong that time. The delay is needed because RMF's supervisor
   sends a CLOSE when it restarts, even if a robot stands in the doorway.
DOOR-2. No output closes the door. Silence never releases the hold, because RMF is silent while a robot
   passes. One exception: if the site has set `supervisor_lost_s`, the hold ends when no node has
   published door requests for that time.
DOOR-3. After the end of a hold, an obstruction switches the hold on again, as long as the obstruction
   lasts. When the door has been seen closed, an obstruction has no effect any more.
DOOR-4. In a fire alarm the site's `on_fire` decides. `open` holds the door open, and no CLOSE releases
   the hold. `release` switches the hold off, clears the latch and refuses OPEN. The state is then
   UNKNOWN for two reasons: no robot may enter a door that is about to close, and RMF's supervisor must
   stop repeating its request.
DOOR-5. Without a fresh reading the state is OFFLINE and the hold is off. The latch is kept, and the
   hold comes on again with the first good reading.
   If no write succeeds for `stale_after_s`, the state is OFFLINE too, because nobody knows whether the
   door is held. The wanted hold stays as it was.
DOOR-6. The state is OPEN only if the limit contact of the open door is active. If both limit contacts
   are active, the state is UNKNOWN. If no limit contact is active, the state is MOVING, and after
   `travel_s` UNKNOWN. If the controller does not report the door's position, the state is UNKNOWN.
DOOR-7. If another node publishes states under this door's name, the state is OFFLINE and the hold is
   off.

A fault is only a text for people; it changes no output. A fault ends when its cause ends, so an
operator has nothing to reset.
"""

from collections.abc import Iterator

from msgspec.structs import replace

from bridges.kinds.door.memory import (
    DoorLimits,
    DoorMemory,
    DoorSenses,
    lost_at,
    opening_ends_at,
    rivalled,
    too_long_at,
    travel_ends_at,
    unwritten_at,
)
from bridges.kinds.door.pulses import advance, changes_at, good_since
from bridges.kinds.door.report import DoorReport, report
from bridges.kinds.door.sensing import BelievedDoor, look, miss, released_by_fire, take
from bridges.kinds.door.signals import CloseRequested, DoorOutputs, Event, OpenRequested
from bridges.kinds.shared.decision import (
    Attended,
    Decision,
    IoFailed,
    RivalSeen,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S


def initial(limits: DoorLimits, now: float) -> DoorMemory:
    """Return the memory at start, before any reading. The hold is off."""
    return DoorMemory(held_since=now)


def decide(
    memory: DoorMemory, event: Event, now: float, limits: DoorLimits
) -> Decision[DoorMemory, DoorOutputs, DoorReport]:
    """Apply the event, and derive the hold and the report. Never raises.

    `now`: monotonic seconds, never earlier than in the last call.
    """
    memory, refused = _hear(memory, event, now, limits)
    memory = _let_go(memory, now, limits)
    memory = _hold(memory, _look(memory, now, limits), now, limits)
    memory = _pulse(memory, event, now, limits)
    view = _look(memory, now, limits)
    is_on = memory.pulses is None or memory.pulses.is_on
    return Decision(
        memory=memory,
        outputs=DoorOutputs(memory.held and is_on, between_pulses=memory.held and not is_on),
        report=report(memory, view, now, limits),
        wake_at=min((at for at in _wakes(memory, view, limits) if at > now), default=NEVER),
        refused=refused,
    )


def repeated(memory: DoorMemory, now: float) -> DoorMemory:
    """Return the memory after the same reading came once more. The caller has checked that only the
    time of the reading differs."""
    return replace(memory, senses=replace(memory.senses, read_at=now))


def _hear(
    memory: DoorMemory, event: Event, now: float, limits: DoorLimits
) -> tuple[DoorMemory, str]:
    match event:
        case Sampled(sample):
            senses = take(memory.senses, sample, now, limits)
            return _written(replace(memory, senses=senses)), ""
        case Suspended(reason):
            return replace(memory, senses=DoorSenses(), io_failure=reason), ""
        case WriteFailed(reason):
            senses = replace(memory.senses, linked_since=None)
            since = now if memory.unwritten_since is None else memory.unwritten_since
            memory = replace(memory, unwritten_since=since, write_failed=True)
            return replace(memory, senses=senses, io_failure=reason), ""
        case IoFailed(reason):
            senses = miss(memory.senses)
            return replace(memory, senses=senses, io_failure=reason, unwritten_since=None), ""
        case RivalSeen():
            return replace(memory, rival_at=now), ""
        case Attended(yes):
            return replace(memory, unattended_since=None if yes else now), ""
        case OpenRequested():
            return _open(memory, now, limits)
        case CloseRequested():
            return _close(memory, now, limits), ""
    return memory, ""  # an operator's reset has no effect: no fault of a door latches


def _written(memory: DoorMemory) -> DoorMemory:
    """Note at a reading that the outputs were written, if no write has failed since the last one."""
    if memory.write_failed:
        return replace(memory, write_failed=False)
    return replace(memory, io_failure="", unwritten_since=None)


def _open(memory: DoorMemory, now: float, limits: DoorLimits) -> tuple[DoorMemory, str]:
    if released_by_fire(_look(memory, now, limits), limits):
        return memory, "the fire alarm has released the door"
    latched_at = now if memory.latched_at is None else memory.latched_at
    unattended_since = None if memory.unattended_since is None else now
    return (
        replace(memory, latched_at=latched_at, close_at=None, unattended_since=unattended_since),
        "",
    )


def _close(memory: DoorMemory, now: float, limits: DoorLimits) -> DoorMemory:
    if memory.latched_at is None or memory.close_at is not None:
        return memory
    return replace(memory, close_at=now + limits.t.close_grace_s)


def _let_go(memory: DoorMemory, now: float, limits: DoorLimits) -> DoorMemory:
    close_at = NEVER if memory.close_at is None else memory.close_at
    if now < min(close_at, lost_at(memory, limits)):
        return memory
    return replace(memory, latched_at=None, close_at=None)


def _look(memory: DoorMemory, now: float, limits: DoorLimits) -> BelievedDoor:
    since = memory.held_since
    if memory.held and limits.pulse is not None:
        since = good_since(memory.pulses)
    return look(memory.senses, memory.held, since, now, limits)


def _hold(memory: DoorMemory, view: BelievedDoor, now: float, limits: DoorLimits) -> DoorMemory:
    """Switch the hold on or off. Also note the time since which the door has been between its end
    positions, and the time since which it has not been open."""
    if released_by_fire(view, limits):
        memory = replace(memory, latched_at=None, close_at=None)
    able = view.fresh and not rivalled(memory, now)
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


def _wanted(memory: DoorMemory, view: BelievedDoor, limits: DoorLimits) -> bool:
    if view.fire:
        return limits.on_fire == "open"
    return memory.latched_at is not None


def _since(before: float | None, is_so: bool, now: float) -> float | None:
    if not is_so:
        return None
    return now if before is None else before


def _pulse(memory: DoorMemory, event: Event, now: float, limits: DoorLimits) -> DoorMemory:
    if limits.pulse is None or not memory.held:
        return memory if memory.pulses is None else replace(memory, pulses=None)
    failed = isinstance(event, IoFailed)
    return replace(memory, pulses=advance(memory.pulses, failed, now, limits.pulse))


def _wakes(memory: DoorMemory, view: BelievedDoor, limits: DoorLimits) -> Iterator[float]:
    """Yield each time at which the decision may change without an event."""
    yield view.changes_at
    yield NEVER if memory.close_at is None else memory.close_at
    yield NEVER if memory.rival_at is None else memory.rival_at + RIVAL_QUIET_S
    yield travel_ends_at(memory, limits)
    yield opening_ends_at(memory, limits)
    yield too_long_at(memory, limits)
    yield lost_at(memory, limits)
    yield unwritten_at(memory, limits)
    if memory.pulses is not None and limits.pulse is not None:
        yield changes_at(memory.pulses, limits.pulse)
