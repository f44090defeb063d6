"""A walk through all states that the charger's core can reach within some steps.

A state consists of the core's memory, the station with its pad, and a ledger. The ledger has the events
so far, and this file writes it without the core's code. All times in a state are relative to now.

The walk replaces long ages by an upper limit, and sets the counts of commands to 0. So two states in
which the core must behave alike count as one state.
"""

from collections.abc import Callable
from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.kinds.charger.core import decide
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerDurations, RobotName, robot
from bridges.kinds.charger.signals import (
    Activity,
    Cancelled,
    ChargeRequested,
    ChargerOutputs,
    ChargerSample,
    Event,
    Measured,
)
from bridges.kinds.shared.decision import (
    Decision,
    IoFailed,
    OperatorReset,
    RivalSeen,
    Sampled,
    WriteFailed,
)
from tests.walk import Walker

LIMITS = ChargerDurations(
    misses=2, start_timeout_s=8.0, stop_timeout_s=4.0, released_s=2.0, peer_internal_timeout_s=16.0
)
RECEIVERS = {"1": robot("tiny/A"), "2": robot("tiny/B")}
OLDEST_S = 4096.0
RIVAL_S, CLEAR_S = 5.0, 30.0

SITES = {
    "observed": ChargerLimits(LIMITS, can_stop=False),
    "unverified": ChargerLimits(LIMITS),
    "refuses": ChargerLimits(LIMITS, RECEIVERS),
    "serves": ChargerLimits(LIMITS, RECEIVERS, "serve_known"),
    "clears by itself": ChargerLimits(
        ChargerDurations(misses=2, start_timeout_s=8.0, clear_errors_per_h=60), RECEIVERS
    ),
}


class Ledger(msgspec.Struct, frozen=True):
    """The events so far, noted without the core's conclusions. Times are relative to the state's time.

    - `granted` is the id of the core's present request, "" for a charge without a request.
    - `robot` is the robot of that request.
    - `spoiled` says that the request was cancelled, or that an error was read after the grant.
    - `read_at` is the time of the last good reading. `misses` counts the failed readings after it.
    - `out` says that the station is out of service. A reading has shown a fault of the station itself,
      and no later clearing of errors has succeeded.
    - `cleared_at` is the time of the last clearing of errors.
    """

    granted: str | None = None
    robot: RobotName | None = None
    spoiled: bool = False
    read_at: float | None = None
    misses: int = 0
    rival_at: float | None = None
    out: bool = False
    cleared_at: float | None = None
    adopted: bool = False


class World(msgspec.Struct, frozen=True):
    """The station, the core's memory and the ledger. All times in them are relative to now.

    `readable` says whether the station answers readings. `writable` says whether it obeys commands.
    """

    memory: ChargerMemory = ChargerMemory()
    ledger: Ledger = Ledger()
    sample: ChargerSample = ChargerSample(Activity.IDLE, 0, measured=Measured(receiver_id=""))
    seen: ChargerSample | None = None
    readable: bool = True
    writable: bool = True


class Step(msgspec.Struct, frozen=True):
    """One decision of the core, with the world before the decision and the ledger after the
    decision."""

    before: World
    event: Event
    now: float
    limits: ChargerLimits
    decision: Decision[ChargerMemory, ChargerOutputs, ChargerReport]
    ledger: Ledger
    seen: ChargerSample | None


Seen = Callable[[Step], None]
Move = Callable[[World], tuple[World, list[Event]]]


# ---- possible events


def reading(world: World) -> list[Event]:
    """Return the events of a scan: a reading or its failure, and a failed write if the station obeys
    nothing."""
    if not world.readable:
        return [IoFailed("timeout")]
    return [Sampled(world.sample), *([] if world.writable else [WriteFailed("status 500")])]


def _station(**changes: Any) -> Move:
    def move(world: World) -> tuple[World, list[Event]]:
        world = replace(world, sample=replace(world.sample, **{"side": "", **changes}))
        return world, reading(world)

    return move


def _pad(**changes: Any) -> Move:
    def move(world: World) -> tuple[World, list[Event]]:
        measured = replace(world.sample.measured, **changes)
        world = replace(world, sample=replace(world.sample, measured=measured))
        return world, reading(world)

    return move


def _toggled(part: str) -> Move:
    def move(world: World) -> tuple[World, list[Event]]:
        toggled: Any = {part: not getattr(world, part)}
        world = replace(world, **toggled)
        return world, reading(world)

    return move


def _event(event: Event) -> Move:
    return lambda world: (world, [event])


MOVES: dict[str, Move] = {
    **{f"{who} asks": _event(ChargeRequested(f"req-{who}", "tiny", who)) for who in "AB"},
    **{f"{who} cancels": _event(Cancelled(f"req-{who}")) for who in "AB"},
    **{str(a): _station(activity=a) for a in Activity},
    "robot's error": _station(activity=Activity.ERROR, side="robot"),
    "A docks": _pad(receiver_id="1"),
    "B docks": _pad(receiver_id="2"),
    "a stranger docks": _pad(receiver_id="9"),
    "the pad is clear": _pad(receiver_id=""),
    "nobody says who": _pad(receiver_id=None),
    "in range": _pad(in_range=True),
    "out of range": _pad(in_range=False),
    "pad down": _pad(at_height=False),
    "pad at height": _pad(at_height=True),
    "gap wrong": _pad(range_ok=False),
    "gap right": _pad(range_ok=True),
    "link lost or back": _toggled("readable"),
    "commands lost or back": _toggled("writable"),
    "rival": _event(RivalSeen()),
    "reset": _event(OperatorReset()),
}
WAITS = (1.0, 5.0, 32.0)


def moved(world: World, move: Move, limits: ChargerLimits, seen: Seen) -> World:
    """Return the world after this move."""
    world, events = move(world)
    for event in events:
        world = decided(world, event, 0.0, limits, seen)
    return world


def waited(world: World, seconds: float, limits: ChargerLimits, seen: Seen) -> World:
    """Return the world after this time, with a scan at least every four seconds."""
    while seconds > 0:
        after_s = min(seconds, 4.0)
        for n, event in enumerate(reading(world)):
            world = decided(world, event, 0.0 if n else after_s, limits, seen)
        seconds -= after_s
    return world


def decided(world: World, event: Event, now: float, limits: ChargerLimits, seen: Seen) -> World:
    """Let the core decide at `now`. Return the new world, with its times relative to `now`."""
    decision = decide(world.memory, event, now, limits)
    ledger = noted(world, event, now, limits, decision)
    sample = event.sample if isinstance(event, Sampled) else world.seen
    seen(Step(world, event, now, limits, decision, ledger, sample))
    return replace(
        world,
        memory=alike(decision.memory, now, limits),
        ledger=_shifted(ledger, now),
        seen=sample,
    )


# ---- the ledger


def noted(world: World, event: Event, now: float, limits: ChargerLimits, decision: Any) -> Ledger:
    """Return the ledger after an event and the core's decision about the event."""
    ledger = world.ledger
    cleared = decision.outputs.clear_errors > world.memory.clear_errors
    if isinstance(event, Sampled):
        ledger = _read(ledger, event.sample, now, limits)
    elif isinstance(event, IoFailed) and not isinstance(event, WriteFailed):
        ledger = replace(ledger, misses=min(ledger.misses + 1, limits.t.misses))
    elif isinstance(event, RivalSeen):
        ledger = replace(ledger, rival_at=now)
    elif (
        isinstance(event, ChargeRequested)
        and not decision.refused
        and event.request_id != ledger.granted
    ):
        ledger = replace(
            ledger, granted=event.request_id, robot=event.who, spoiled=False, adopted=False
        )
    elif isinstance(event, Cancelled) and event.request_id == ledger.granted:
        ledger = replace(ledger, spoiled=True)
    if cleared:
        ledger = replace(ledger, cleared_at=now)
    return _held(ledger, decision)


def _read(ledger: Ledger, sample: ChargerSample, now: float, limits: ChargerLimits) -> Ledger:
    came = ledger.read_at is None or ledger.misses >= limits.t.misses
    if sample.activity is Activity.CHARGING and sample.measured.at_height is False:
        sample = replace(sample, activity=Activity.ERROR, side="station")
    bad = sample.activity in (Activity.ERROR, Activity.UNKNOWN)
    flows = sample.activity in (Activity.CHARGING, Activity.STOPPING)
    well = not bad and not flows
    helped = ledger.cleared_at is not None and now - ledger.cleared_at <= CLEAR_S and well
    who = limits.receivers.get(sample.measured.receiver_id or "")
    another = sample.measured.receiver_id and limits.receivers and who != ledger.robot
    intruders = another and sample.side == "robot"
    own = sample.activity is Activity.ERROR and sample.side != "robot" and limits.can_stop
    return replace(
        ledger,
        read_at=now,
        misses=0,
        spoiled=ledger.spoiled or (bad and not intruders),
        out=own or (ledger.out and not helped),
        adopted=flows and ledger.granted is None and (came or ledger.adopted),
    )


def _held(ledger: Ledger, decision: Any) -> Ledger:
    """Return the ledger, without its request if the core has no request now.

    The function does not judge the end of the request, because other rules do.
    """
    shown = decision.report
    if decision.memory.holder is None:
        return replace(ledger, granted=None, robot=None, spoiled=False)
    who = RobotName(shown.fleet, shown.robot)
    if not shown.request_id and (ledger.granted != "" or who != ledger.robot):
        # the core shows a robot that charges without a request
        return replace(ledger, granted="", robot=who, spoiled=False, adopted=False)
    return ledger


# ---- states with their times relative to now


def alike(memory: ChargerMemory, now: float, limits: ChargerLimits) -> ChargerMemory:
    """Return the memory with its times relative to now.

    If the core must behave alike with two memories, this function returns equal memories for them.
    """
    holder = memory.holder
    if holder:
        holder = replace(
            holder,
            start_by=max(holder.start_by - now, -1.0),
            paused_at=_at(holder.paused_at, now),
            checked_at=_at(holder.checked_at, now, 8.0),
            flowed_at=_at(holder.flowed_at, now, limits.t.start_timeout_s),
            released_at=_at(holder.released_at, now, limits.t.released_s),
        )
    return replace(
        memory,
        holder=holder,
        read_at=_at(memory.read_at, now, 64.0),
        misses=min(memory.misses, limits.t.misses),
        write_misses=min(memory.write_misses, limits.t.misses),
        disobeyed_since=_at(memory.disobeyed_since, now, limits.t.stop_timeout_s),
        clear_by=max(memory.clear_by - now, -1.0),
        cleared_at=_at(memory.cleared_at, now),
        rival_at=_at(memory.rival_at, now, RIVAL_S),
        clear_errors=0,
        range_checks=0,
    )


def _shifted(ledger: Ledger, now: float) -> Ledger:
    return replace(
        ledger,
        read_at=_at(ledger.read_at, now, 64.0),
        rival_at=_at(ledger.rival_at, now, RIVAL_S),
        cleared_at=_at(ledger.cleared_at, now, 64.0),
    )


def _at(at: Any, now: float, oldest_s: float = OLDEST_S) -> Any:
    """Return a time relative to now. Ages above `oldest_s` become `oldest_s`, and None stays None."""
    return None if at is None else max(at - now, -oldest_s)


def walker(limits: ChargerLimits) -> Walker[World, Move]:
    """Return a walker through the states of a charger with these limits."""
    return Walker(
        MOVES,
        WAITS,
        lambda world, move, seen: moved(world, move, limits, seen),
        lambda world, seconds, seen: waited(world, seconds, limits, seen),
    )
