"""A walk through all states that the lift's core can reach within some steps.

A state consists of the core's memory and the building. All times in a state are relative to now. The
walk replaces long ages by an upper limit. So two states in which the core must behave alike count as
one state.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.kinds.lift.core import decide, initial, published
from bridges.kinds.lift.memory import ForgottenSession, LiftLimits, LiftMemory, OwnWords
from bridges.kinds.lift.relays import Channel
from bridges.kinds.lift.settings import LiftDurations, LiftSettings
from bridges.kinds.lift.signals import (
    DoorReading,
    EndRequested,
    Event,
    FromAdapter,
    Hazard,
    LiftRequested,
    LiftSample,
    Motion,
)
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled, WriteFailed
from bridges.kinds.shared.durations import AGES_AGO
from bridges.kinds.shared.freshness import Requester
from tests.walk import Walker

LONG_S = 55.0
"""The longest time (s) between two scans, if `wake_at` is not earlier. LONG_S is less than
`stale_after_s`."""


def limits_of(
    debounce: dict[str, float] | None = None, agv_mode: Any = "requested", **changes: Any
) -> LiftLimits:
    """Return the default limits, except that a reading stays fresh for a minute.

    This makes the walk shorter, because it needs fewer scans.
    """
    settings = LiftSettings(
        floors=["L1", "L2", "L3"],
        limits=LiftDurations(**{"stale_after_s": 60.0, **changes}),
        fire_reset="manual",
        alarm="fire_alarm_trigger",
        agv_mode=agv_mode,
    )
    return LiftLimits.of(settings, debounce or {})


class World(msgspec.Struct, frozen=True):
    """The building with its inputs, and the core's memory. All times in them are relative to now.

    `readable` says whether the inputs can be read. `writable` says whether the outputs can be written.
    """

    memory: LiftMemory
    sample: LiftSample
    readable: bool = True
    writable: bool = True


IDLE = LiftSample("L1", DoorReading.CLOSED, motion=Motion.STOPPED, agv=False)


def start(limits: LiftLimits) -> World:
    """Return a daemon that has just started on an idle lift."""
    return World(initial(limits, 0.0), IDLE)


# ---- possible events

Move = Callable[[World], tuple[World, Event]]


def _inputs(**changes: Any) -> Move:
    def move(world: World) -> tuple[World, Event]:
        world = replace(world, sample=replace(world.sample, **changes))
        return world, reading(world)

    return move


def _hazard(hazard: Hazard) -> Move:
    def move(world: World) -> tuple[World, Event]:
        world = replace(
            world, sample=replace(world.sample, hazards=world.sample.hazards ^ {hazard})
        )
        return world, reading(world)

    return move


def _event(event: Event) -> Move:
    return lambda world: (world, event)


def _bus(world: World) -> tuple[World, Event]:
    world = replace(world, readable=not world.readable)
    return world, reading(world)


def _relays(world: World) -> tuple[World, Event]:
    world = replace(world, writable=not world.writable)
    return world, reading(world)


def reading(world: World) -> Event:
    """Return the event of a scan: a reading, or a failure."""
    return Sampled(world.sample) if world.readable else IoFailed("timeout")


MOVES: dict[str, Move] = {
    **{
        f"{who} asks {floor}": _event(LiftRequested(who, True, floor, stamp=2 * 10**9))
        for who in ("A", "B")
        for floor in ("L1", "L3")
    },
    "A ends, stamped": _event(EndRequested("A", stamp=3 * 10**9)),
    "A ends, long ago": _event(EndRequested("A", stamp=10**9)),
    "a person ends A": _event(EndRequested("A", by_person=True)),
    "A asks human": _event(LiftRequested("A", False, "L1")),
    "A ends": _event(EndRequested("A")),
    "B ends": _event(EndRequested("B")),
    "A's adapter asks L3": _event(FromAdapter(LiftRequested("A", True, "L3", 1))),
    "A's adapter ends": _event(FromAdapter(EndRequested("A"))),
    "agv on": _inputs(agv=True),
    "agv off": _inputs(agv=False),
    **{f"at {level}": _inputs(level=level, code_fault="") for level in ("L1", "L2", "L3", None)},
    "illegal code": _inputs(level=None, code_fault="parity"),
    "door open": _inputs(door=DoorReading.OPEN),
    "door closed": _inputs(door=DoorReading.CLOSED),
    "moving": _inputs(motion=Motion.MOVING),
    "standing": _inputs(motion=Motion.STOPPED),
    **{hazard: _hazard(hazard) for hazard in (Hazard.FIRE, Hazard.MANUAL, Hazard.OVERLOAD)},
    "bus lost or back": _bus,
    "relays lost or back": _relays,
    "rival": _event(RivalSeen()),
    "reset": _event(OperatorReset()),
}
TIMES = (0.05, 1.0, 4.0, 15.0, 700.0)


# ---- one step

Seen = Callable[["Step"], None]


class Step(msgspec.Struct, frozen=True):
    """One decision. `now` is its time in seconds after the state before it. `exact` says that this lift
    has no debounce."""

    before: LiftMemory
    event: Event
    decision: Any
    world: World
    now: float
    limits: LiftLimits
    exact: bool = True


def moved(world: World, move: Move, limits: LiftLimits, seen: Seen) -> World:
    """Return the state after a move, without any passing of time."""
    around, event = move(world)
    return _decided(around, event, 0.0, limits, seen)


def waited(world: World, seconds: float, limits: LiftLimits, seen: Seen) -> World:
    """Return the state after `seconds`. In this time the lift is scanned at each `wake_at` of the
    core."""
    now, wake_at = 0.0, 0.0
    while now < seconds:
        now = min(seconds, max(now + 0.001, min(wake_at, now + LONG_S)))

        def note(step: Step) -> None:
            nonlocal wake_at
            wake_at = step.decision.wake_at
            seen(step)

        world = _decided(world, reading(world), now, limits, note)
    return replace(world, memory=shifted(world.memory, -now))


def _decided(world: World, event: Event, now: float, limits: LiftLimits, seen: Seen) -> World:
    """Scan once: decide, write and publish."""
    step = _step(world, world.memory, event, now, limits, seen)
    if not world.writable:
        step = _step(world, step.decision.memory, WriteFailed("timeout"), now, limits, seen)
    return replace(world, memory=published(step.decision.memory, step.decision.report))


def _step(
    world: World, before: LiftMemory, event: Event, now: float, limits: LiftLimits, seen: Seen
) -> Step:
    step = Step(before, event, decide(before, event, now, limits), world, now, limits)
    seen(step)
    return step


# ---- states with their times relative to now

AGES = {
    "off_at": 2.0,
    "ons": 60.0,
    "asked_at": 31.0,
    "call_at": 10.0,
    "seen_at": 2.0,
    "moved_at": 5.0,
    "read_at": 61.0,
    "torn_since": 10.0,
    "value_since": 10.0,
    "unwritten_since": 61.0,
    "since": 700.0,
}
"""The age (s) of each kind of time above which the core's behaviour does not depend on the age."""


def shifted(memory: LiftMemory, by: float) -> LiftMemory:
    """Return the memory with `by` added to each of its times. Ages above their limit become the
    limit."""
    senses, session, grace = memory.senses, memory.session, memory.grace
    return replace(
        memory,
        senses=replace(
            senses,
            read_at=_at(senses.read_at, by, "read_at"),
            code=_settled(senses.code, by),
            doors=tuple(_settled(door, by) for door in senses.doors),
            motion=_settled(senses.motion, by),
            agv=_settled(senses.agv, by),
            hazards={h: _settled(s, by) for h, s in senses.hazards.items()},
            position=replace(
                senses.position,
                seen_at=_at(senses.position.seen_at, by, "seen_at"),
                moved_at=_at(senses.position.moved_at, by, "moved_at"),
            ),
        ),
        session=session and _session(session, by),
        grace=grace
        and replace(
            grace,
            session=_session(grace.session, by),
            off_at=max(_at(grace.off_at, by), -0.5),
            until=_at(grace.until, by),
        ),
        relays=replace(
            memory.relays,
            agv=_channel(memory.relays.agv, by),
            call=_channel(memory.relays.call, by),
            hold=_channel(memory.relays.hold, by),
        ),
        rival_at=_at(memory.rival_at, by),
        unwritten_since=_at(memory.unwritten_since, by, "unwritten_since"),
    )


def _at(at: Any, by: float, kind: str = "") -> Any:
    """Return a time plus `by`. Ages above the limit for `kind` in AGES become the limit. None stays
    None."""
    if at is None:
        return None
    return max(round(at + by, 6), -AGES.get(kind, 1e9))


@lru_cache(maxsize=4096)
def _settled(seen: Settled[Any] | None, by: float) -> Any:
    return seen and replace(
        seen,
        since=max(_at(seen.since, by), -10.0),
        steady_at=None if seen.steady_at is None else 0.0,
        torn_since=_at(seen.torn_since, by, "torn_since"),
        value_since=_at(seen.value_since, by, "value_since"),
    )


def _session(session: Any, by: float) -> Any:
    return replace(
        session,
        asked_at=_at(session.asked_at, by, "asked_at"),
        call_at=_at(session.call_at, by, "call_at"),
        since=_at(session.since, by, "since") if session.waiting else 0.0,
        retry_at=_at(session.retry_at, by),
        forgotten=session.forgotten and _forgotten(session.forgotten, by),
        robot=_robot(session.robot, by),
        ends=_ends(session.ends, by),
    )


def _forgotten(forgotten: ForgottenSession, by: float) -> ForgottenSession:
    return replace(forgotten, since=max(_at(forgotten.since, by), -4.0))


def _robot(robot: OwnWords, by: float) -> OwnWords:
    """Return what the robot's adapter has said, with `by` added to each time.

    If the adapter has said nothing, `asked_at` stays AGES_AGO.
    """
    heard = robot.asked_at > AGES_AGO
    asked_at = max(_at(robot.asked_at, by), -7.0) if heard else AGES_AGO
    ended_at = round(robot.ended_at + by, 6)
    return replace(
        robot,
        stamp=0,
        asked_at=asked_at,
        ended_at=_recent(ended_at, 8.0),
        clock=Requester(),
    )


def _ends(ends: Requester, by: float) -> Requester:
    since, at = round(ends.doubted_since + by, 6), round(ends.doubted_at + by, 6)
    return replace(
        ends, doubted_since=_recent(since, 5.0), doubted_at=_recent(at, 4.0), heard_at=0.0
    )


def _recent(at: float, age_s: float) -> float:
    return at if at > -age_s else AGES_AGO


def _channel(channel: Channel[Any], by: float) -> Any:
    ons = tuple(_at(on, by) for on in channel.ons)
    return replace(
        channel,
        off_at=_at(channel.off_at, by, "off_at"),
        ons=tuple(on for on in ons if on > -AGES["ons"]),
    )


def key(world: World) -> tuple[Any, ...]:
    """Return a key of the world. If the core must behave alike in two worlds, their keys are equal."""
    memory, senses = world.memory, world.memory.senses
    hazards = tuple(senses.hazards.get(h) for h in Hazard)
    return (
        (senses.read_at, senses.code, senses.doors, senses.motion, senses.agv, hazards),
        (senses.position, memory.session, memory.grace, memory.relays, memory.fire_latched),
        (memory.rival_at, memory.io_fault, memory.unwritten_since),
        (memory.write_failed, world.sample, world.readable, world.writable),
        tuple(sorted(memory.own.items())),
    )


def walker(limits: LiftLimits) -> Walker[World, Move]:
    """Return a walker through the states of a lift with these limits."""
    return Walker(
        MOVES,
        TIMES,
        lambda world, move, seen: moved(world, move, limits, seen),
        lambda world, seconds, seen: waited(world, seconds, limits, seen),
        key,
    )
