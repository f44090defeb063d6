"""A walk through all states that the door's core can reach within some steps.

A state consists of the core's memory, the building, and a ledger of events. All times in a state are
relative to now. This file writes the ledger by the rules of the door, without the core's code.

The walk replaces long ages by an upper limit. So two states in which the core must behave alike count
as one state. All durations are sums of powers of two, so no time is rounded.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import msgspec
from msgspec.structs import replace

from bridges.kinds.door.core import decide, initial
from bridges.kinds.door.memory import DoorLimits, DoorMemory
from bridges.kinds.door.pulses import DoorPulses
from bridges.kinds.door.settings import DoorDurations
from bridges.kinds.door.signals import CloseRequested, DoorSample, Event, OpenRequested
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled, WriteFailed
from bridges.kinds.shared.durations import RIVAL_QUIET_S
from tests.kinds.door.virtual import Decided
from tests.walk import Walker

LONG_S = 32.0
"""The longest time (s) between two scans, if `wake_at` is not earlier. LONG_S is less than
`stale_after_s`."""

DURATIONS: dict[str, float] = {"stale_after_s": 60.0, "max_hold_s": 30.0}
"""The durations (s) that differ from the defaults.

A long `stale_after_s` makes the walk shorter, because it needs fewer scans. `max_hold_s` turns on the
alarm for a long hold.
"""


def limits_of(durations: dict[str, float] | None = None, **facts: Any) -> DoorLimits:
    """Return the limits of a door. The argument's durations override the table DURATIONS. The table
    overrides the defaults."""
    return DoorLimits(t=DoorDurations(**{**DURATIONS, **(durations or {})}), **facts)


class Ledger(msgspec.Struct, frozen=True):
    """The events so far, noted without the core's conclusions. Times are relative to the state's time.

    - `wanted` says that RMF wants the door open.
    - `ends_at` is the time at which RMF's CLOSE takes effect, after the grace.
    - `let_go` says that the reason for the hold has ended. It lasts until a reading shows the door
      closed.
    - `shut` says that the last reading shows the door closed.
    - `sure_since` is the time of the last change of the hold, or of the first reading after a failure.
    - `unlike` has a time for each contact in UNLIKE. Since that time all readings were "not asserted".
    - `pulse` is the last pulse of the hold, if the operator needs pulses.
    """

    held: bool = False
    wanted: bool = False
    ends_at: float | None = None
    let_go: bool = False
    shut: bool = False
    read_at: float | None = None
    rival_at: float | None = None
    sure_since: float | None = None
    unlike: tuple[float | None, ...] = (None, None, None)
    pulse: "PulseSeen | None" = None


class PulseSeen(msgspec.Struct, frozen=True):
    """A pulse of the relay, as seen from outside. Times are relative to the state's time.

    - `at` is its start, and `off_at` its end.
    - `failed_at` is the time of the last failed scan while the relay was on.
    - `row_since` is the start of the first pulse since the last pulse with a failure.
    """

    at: float
    off_at: float | None = None
    failed_at: float | None = None
    row_since: float | None = None


UNLIKE = ("opened", "obstruction", "fire")


class World(msgspec.Struct, frozen=True):
    """The building, the core's memory and the ledger. All times in them are relative to now.

    `readable` says whether the door's contacts answer. `writable` says whether the door's relays
    answer.
    """

    memory: DoorMemory
    sample: DoorSample
    ledger: Ledger = Ledger()
    readable: bool = True
    writable: bool = True


def start(limits: DoorLimits) -> World:
    """Return a daemon right after its start, with a closed door.

    If the site estimates the door's position, the door has no contacts.
    """
    opened, closed = (None, None) if limits.estimated else (False, True)
    return World(initial(limits, 0.0), DoorSample(opened, closed, obstruction=False, fire=False))


# ---- possible events

Move = Callable[[World], tuple[World, Event]]


def _ends(opened: bool, closed: bool) -> Move:
    def move(world: World) -> tuple[World, Event]:
        if world.sample.opened is not None:
            sample = replace(world.sample, opened=opened, closed=closed)
            world = replace(world, sample=sample)
        return world, reading(world)

    return move


def _toggled(signal: str) -> Move:
    def move(world: World) -> tuple[World, Event]:
        toggled: Any = {signal: not getattr(world.sample, signal)}
        sample = replace(world.sample, **toggled)
        world = replace(world, sample=sample)
        return world, reading(world)

    return move


def _lost(world: World) -> tuple[World, Event]:
    sample = replace(world.sample, lost="" if world.sample.lost else "status 9")
    world = replace(world, sample=sample)
    return world, reading(world)


def _event(event: Event) -> Move:
    return lambda world: (world, event)


def _bus(world: World) -> tuple[World, Event]:
    world = replace(world, readable=not world.readable)
    return world, reading(world)


def _relay(world: World) -> tuple[World, Event]:
    world = replace(world, writable=not world.writable)
    return world, reading(world)


def reading(world: World) -> Event:
    """Return the event of a scan: a reading, or a failure."""
    return Sampled(world.sample) if world.readable else IoFailed("timeout")


MOVES: dict[str, Move] = {
    "A opens": _event(OpenRequested("A")),
    "B opens": _event(OpenRequested("B")),
    "A closes": _event(CloseRequested("A")),
    "B closes": _event(CloseRequested("B")),
    "at open": _ends(True, False),
    "at closed": _ends(False, True),
    "between": _ends(False, False),
    "at both": _ends(True, True),
    "obstruction": _toggled("obstruction"),
    "fire": _toggled("fire"),
    "position lost or back": _lost,
    "bus lost or back": _bus,
    "relay lost or back": _relay,
    "rival": _event(RivalSeen()),
    "reset": _event(OperatorReset()),
}
TIMES = (0.0625, 1.0, 4.0, 16.0, 64.0)
"""Waits (s). Some are shorter and some are longer than each duration of the core: debounce, end of a
hazard, grace, travel time, opening time, and greatest age of a reading."""


# ---- one step

Seen = Callable[["Step"], None]


class Step(msgspec.Struct, frozen=True):
    """One decision. `now` is its time in seconds after the state before it. `ledger` includes this
    decision."""

    before: DoorMemory
    event: Event
    decision: Decided
    world: World
    ledger: Ledger
    now: float
    limits: DoorLimits


def moved(world: World, move: Move, limits: DoorLimits, seen: Seen) -> World:
    """Return the state after a move, without any passing of time."""
    around, event = move(world)
    return _scanned(around, event, 0.0, limits, seen)[0]


def waited(world: World, seconds: float, limits: DoorLimits, seen: Seen) -> World:
    """Return the state after `seconds`. In this time the door is scanned at each `wake_at` of the
    core."""
    now = 0.0
    world, wake_at = _scanned(world, reading(world), now, limits, seen)
    while now < seconds:
        now = min(seconds, now + LONG_S, wake_at)
        world, wake_at = _scanned(world, reading(world), now, limits, seen)
    return replace(
        world,
        memory=shifted(world.memory, -now, limits),
        ledger=_shifted(world.ledger, -now, limits),
    )


def _scanned(
    world: World, event: Event, now: float, limits: DoorLimits, seen: Seen
) -> tuple[World, float]:
    """Let the core decide, and let the write fail if the relays do not answer.

    Return the new world, and the time of the next scan (s).
    """
    step = _step(world, event, now, limits, seen)
    world = replace(world, memory=step.decision.memory, ledger=step.ledger)
    if not world.writable:
        step = _step(world, WriteFailed("timeout"), now, limits, seen)
        world = replace(world, memory=step.decision.memory, ledger=step.ledger)
    return world, step.decision.wake_at


def _step(world: World, event: Event, now: float, limits: DoorLimits, seen: Seen) -> Step:
    decision = decide(world.memory, event, now, limits)
    ledger = noted(world.ledger, event, now, decision, limits)
    step = Step(world.memory, event, decision, world, ledger, now, limits)
    seen(step)
    return step


def noted(
    ledger: Ledger, event: Event, now: float, decision: Decided, limits: DoorLimits
) -> Ledger:
    """Return the ledger after a decision.

    The function takes only three facts from the decision: whether the door is held, whether the request
    is refused, and whether a fire is reported.
    """
    wanted, ends_at = _asked(ledger, event, now, bool(decision.refused), limits)
    if limits.on_fire == "release" and burns(decision):
        wanted, ends_at = False, None
    held = decision.report.hold
    sample = event.sample if isinstance(event, Sampled) else None
    reason = limits.on_fire == "open" if burns(decision) else wanted
    shut = ledger.shut and fresh(ledger, now, limits)
    if sample:
        shut = bool(sample.closed) and not sample.lost
    rival_at = now if isinstance(event, RivalSeen) else ledger.rival_at
    after = replace(ledger, rival_at=rival_at, read_at=now if sample else ledger.read_at)
    let_go = ledger.let_go or (ledger.held and not (reason and sighted(after, now, limits)))
    sure_since = ledger.sure_since if held == ledger.held or ledger.sure_since is None else now
    if isinstance(event, IoFailed):
        sure_since = None
    return replace(
        after,
        held=held,
        wanted=wanted,
        ends_at=ends_at,
        let_go=let_go and not shut,
        shut=shut,
        sure_since=now if sample and sure_since is None else sure_since,
        unlike=_unlike(ledger, event, now, limits),
        pulse=_pulse(ledger, event, now, decision) if limits.pulse and held else None,
    )


def _pulse(ledger: Ledger, event: Event, now: float, decision: Decided) -> PulseSeen:
    """Return the pulse after a decision that holds the door. The decision tells whether the relay is
    on."""
    on, pulse, failed = decision.outputs.hold_open, ledger.pulse, isinstance(event, IoFailed)
    if pulse and pulse.off_at is None and failed:
        pulse = replace(pulse, failed_at=now, row_since=None)
    if pulse and pulse.off_at is None and not on:
        pulse = replace(pulse, off_at=now)
    if pulse is None or (pulse.off_at is not None and on):
        row_since = now if pulse is None or pulse.row_since is None else pulse.row_since
        pulse = PulseSeen(now, None, now if failed else None, None if failed else row_since)
    return pulse


def fresh(ledger: Ledger, now: float, limits: DoorLimits) -> bool:
    """Return whether the last reading is fresh."""
    return ledger.read_at is not None and now < ledger.read_at + limits.t.stale_after_s


def sighted(ledger: Ledger, now: float, limits: DoorLimits) -> bool:
    """Return whether the last reading is fresh and no second node has this door's name."""
    rival_at = ledger.rival_at
    alone = rival_at is None or now >= rival_at + RIVAL_QUIET_S
    return alone and fresh(ledger, now, limits)


def burns(decision: Decided) -> bool:
    """Return whether the core reports a fire."""
    return any(fault.code == "FIRE_ALARM" for fault in decision.report.faults)


def _asked(
    ledger: Ledger, event: Event, now: float, refused: bool, limits: DoorLimits
) -> tuple[bool, float | None]:
    """Return whether RMF wants the door open, and the time (s) at which a CLOSE takes effect."""
    wanted, ends_at = ledger.wanted, ledger.ends_at
    if ends_at is not None and now >= ends_at and not isinstance(event, OpenRequested):
        wanted, ends_at = False, None
    if isinstance(event, OpenRequested) and not refused:
        return True, None
    if isinstance(event, CloseRequested) and wanted and ends_at is None:
        ends_at = now + limits.t.close_grace_s
        return ends_at > now, ends_at
    return wanted, ends_at


def _unlike(
    ledger: Ledger, event: Event, now: float, limits: DoorLimits
) -> tuple[float | None, ...]:
    """Return for each contact the time (s) since which all readings were "not asserted", or None."""
    if isinstance(event, Sampled):
        gap = not fresh(ledger, now, limits)
        said = [getattr(event.sample, signal) for signal in UNLIKE]
        return tuple(
            None if is_so else now if gap or since is None else since
            for is_so, since in zip(said, ledger.unlike, strict=True)
        )
    if isinstance(event, IoFailed) and not isinstance(event, WriteFailed):
        return (None,) * len(UNLIKE)
    return ledger.unlike


# ---- states with their times relative to now


def shifted(memory: DoorMemory, by: float, limits: DoorLimits) -> DoorMemory:
    """Return the memory with `by` added to each of its times. Ages above their limit become the
    limit."""
    t, senses = limits.t, memory.senses
    return replace(
        memory,
        latched_at=_at(memory.latched_at, by, t.max_hold_s or 0.0),
        close_at=_at(memory.close_at, by),
        held_since=_at(memory.held_since, by, max(t.travel_s, t.open_timeout_s)),
        between_since=_at(memory.between_since, by, t.travel_s),
        shut_since=_at(memory.shut_since, by, t.open_timeout_s),
        rival_at=_at(memory.rival_at, by, RIVAL_QUIET_S),
        senses=replace(
            senses,
            opened=_settled(senses.opened, by),
            closed=_settled(senses.closed, by),
            obstruction=_settled(senses.obstruction, by),
            fire=_settled(senses.fire, by),
            read_at=_at(senses.read_at, by, t.stale_after_s),
            linked_since=_at(senses.linked_since, by, t.travel_s),
        ),
        pulses=memory.pulses and _shifted_pulse(memory.pulses, by, limits, "good_since"),
    )


def _shifted(ledger: Ledger, by: float, limits: DoorLimits) -> Ledger:
    return replace(
        ledger,
        ends_at=_at(ledger.ends_at, by),
        read_at=_at(ledger.read_at, by, limits.t.stale_after_s),
        rival_at=_at(ledger.rival_at, by, RIVAL_QUIET_S),
        sure_since=_at(ledger.sure_since, by, limits.t.travel_s),
        unlike=tuple(_at(since, by, limits.t.hazard_clear_s) for since in ledger.unlike),
        pulse=ledger.pulse and _shifted_pulse(ledger.pulse, by, limits, "row_since"),
    )


def _at(at: Any, by: float, oldest_s: float = float("inf")) -> Any:
    """Return a time plus `by`. Ages above `oldest_s` become `oldest_s`, and None stays None."""
    return None if at is None else max(at + by, -oldest_s)


P = TypeVar("P", DoorPulses, PulseSeen)


def _shifted_pulse(pulse: P, by: float, limits: DoorLimits, since: str) -> P:
    """Shift the times of a pulse. `since`: the field with the start of the pulses that were good."""
    return replace(
        pulse,
        at=pulse.at + by,
        off_at=_at(pulse.off_at, by),
        failed_at=_at(pulse.failed_at, by),
        **{since: _at(getattr(pulse, since), by, limits.t.travel_s)},
    )


def _settled(seen: Settled[Any] | None, by: float) -> Any:
    """Return a contact with its time moved by `by`. A settled contact gets a fixed time, because its
    time does not matter."""
    if seen is None:
        return None
    return Settled(
        seen.value,
        seen.candidate,
        0.0 if seen.torn_since is None else max(seen.since + by, -1.0),
        steady_at=None if seen.steady_at is None else 0.0,
        torn_since=None if seen.torn_since is None else 0.0,
    )


def alike(world: World, limits: DoorLimits) -> World:
    """Return the world in a reduced form. If the core must behave alike in two worlds, their forms are
    equal."""
    return replace(
        world,
        memory=shifted(world.memory, 0.0, limits),
        ledger=_shifted(world.ledger, 0.0, limits),
    )


def walker(limits: DoorLimits) -> Walker[World, Move]:
    """Return a walker through the states of a door with these limits."""
    return Walker(
        MOVES,
        TIMES,
        lambda world, move, seen: alike(moved(world, move, limits, seen), limits),
        lambda world, seconds, seen: alike(waited(world, seconds, limits, seen), limits),
    )
