"""A walk through all states that a dispenser and RMF's phase DispenseItem can reach within some steps.

A state has the core's memory, the disk, the machine and RMF's phase. All times are relative to now.
This file has its own version of RMF's phase, written after `_get_status` of DispenseItem.cpp. In it
every message has a newer stamp than the messages before it.
"""

import math
from collections.abc import Callable
from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.kinds.dispenser.core import decide, initial, published
from bridges.kinds.dispenser.keep import KEEPING
from bridges.kinds.dispenser.memory import WorkcellLimits, WorkcellMemory
from bridges.kinds.dispenser.signals import Event, Item, ItemRequested, WorkcellSample
from bridges.kinds.shared.decision import (
    DecidedByPerson,
    IoFailed,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
    RivalSeen,
    Sampled,
)
from bridges.messages.constants import WorkcellStatus
from tests.walk import Walker

LIMITS = WorkcellLimits(pulse_s=None)
LONGEST_S = 1024.0
GUID = "task"


class Phase(msgspec.Struct, frozen=True):
    """RMF's phase DispenseItem.

    `deaf` says that no message reaches the phase. `stamped` says that the phase has received a message
    with a stamp other than 0. From then on the phase ignores each state with the stamp 0 as too old.
    """

    asks: bool = False
    stamped: bool = False
    acknowledged: bool = False
    outcome: str = ""
    deaf: bool = False


class World(msgspec.Struct, frozen=True):
    """The daemon, its machine, and RMF's phase.

    - `disk` has the bytes that outlive the daemon.
    - `works` says that the machine is in a dispensing cycle.
    - `moved` is the number of items that have left the machine.
    - `again` is the number of times that a person has ordered another cycle.
    - `decided` says that a person has decided a request in doubt.
    """

    memory: WorkcellMemory
    disk: bytes = b""
    full: bool = False
    down: bool = False
    on: bool = False
    works: bool = False
    done: bool = False
    moved: int = 0
    again: int = 0
    decided: bool = False
    phase: Phase = Phase()


class Step(msgspec.Struct, frozen=True):
    """The state and the outputs after a scan. The test checks its rules on each step."""

    world: World
    outputs: Any


def start() -> World:
    """Return a new daemon beside a machine at rest."""
    memory = initial(LIMITS, 0.0)
    return World(memory, KEEPING.persist(memory))


Move = Callable[[World], tuple[World, Event | None]]


def reading(world: World) -> Event:
    """Return the event of a scan: a reading, or a timeout."""
    if world.down:
        return IoFailed("timeout")
    ready = not (world.works or world.done)
    return Sampled(WorkcellSample(world.done, world.works, ready, fault=False))


def _asks(world: World) -> tuple[World, Event | None]:
    phase = world.phase
    if phase.outcome:
        return world, None
    world = replace(world, phase=replace(phase, asks=True))
    return world, ItemRequested(GUID, Item("box", 1))


def _finishes(world: World) -> tuple[World, Event | None]:
    if world.works:
        world = replace(world, works=False, done=True, moved=world.moved + 1)
    return world, reading(world)


def _stops(world: World) -> tuple[World, Event | None]:
    world = replace(world, works=False)
    return world, reading(world)


def _dies(world: World) -> tuple[World, Event | None]:
    """Let the daemon die. Its outputs go off, and a new daemon reads the disk."""
    world = _switched(replace(world, memory=KEEPING.restore(world.disk, 0.0)), on=False)
    return world, reading(world)


def _loses(world: World) -> tuple[World, Event | None]:
    memory = KEEPING.lost("removed")
    world = replace(world, memory=memory, disk=KEEPING.persist(memory))
    return _dies(world)


def _decides(verdict: Any) -> Move:
    """Return a move: a person looks at the machine and gives this verdict.

    The person says `done` only if an item has moved, and `again` only if no item has moved.
    """

    def move(world: World) -> tuple[World, Event | None]:
        in_doubt = bool(world.memory.lost or world.memory.doubtful())
        if not in_doubt or world.works or (verdict == "done") != (world.moved > 0):
            return world, None
        return replace(world, decided=True), DecidedByPerson(verdict)

    return move


def _event(event: Event) -> Move:
    return lambda world: (world, event)


def _toggles(field: str) -> Move:
    def move(world: World) -> tuple[World, Event | None]:
        world = replace(world, **{field: not getattr(world, field)})
        return world, reading(world)

    return move


def _deaf(world: World) -> tuple[World, Event | None]:
    phase = replace(world.phase, deaf=not world.phase.deaf)
    return replace(world, phase=phase), None


MOVES: dict[str, Move] = {
    "RMF asks": _asks,
    "RMF hears or not": _deaf,
    "finishes": _finishes,
    "stops": _stops,
    "dies": _dies,
    "loses its memory": _loses,
    "disk full or not": _toggles("full"),
    "bus down or not": _toggles("down"),
    "done": _decides("done"),
    "again": _decides("again"),
    "reset": _event(OperatorReset()),
    "rival": _event(RivalSeen()),
}
TIMES = (0.5, 2.0, 8.0, 512.0)


def moved(world: World, move: Move, seen: Callable[[Any], None]) -> World:
    """Return the state after a move and one scan."""
    world, event = move(world)
    return _scanned(world, event or reading(world), 0.0, seen)


def waited(world: World, seconds: float, seen: Callable[[Any], None]) -> World:
    """Return the state after `seconds`. In this time the daemon scans, and RMF repeats its request."""
    now, step_s = 0.0, max(0.25, seconds / 8)
    while now < seconds:
        now += step_s
        world = _scanned(world, reading(world), now, seen)
        if world.phase.asks and not world.phase.outcome and seconds < 500.0:
            world = _scanned(world, ItemRequested(GUID, Item("box", 1)), now, seen)
    return replace(world, memory=_shifted(world.memory, now))


def _scanned(world: World, event: Event, now: float, seen: Callable[[Any], None]) -> World:
    """Do a scan as the daemon's node does it: decide, write the memory to the disk, drive the outputs,
    and publish."""
    decision = decide(world.memory, event, now, LIMITS)
    kept = KEEPING.persist(decision.memory)
    if kept != world.disk or decision.memory.not_kept:
        outcome: Event = MemoryNotKept("full") if world.full else MemoryKept()
        world = world if world.full else replace(world, disk=kept)
        decision = decide(decision.memory, outcome, now, LIMITS)
    world = _switched(world, on=decision.outputs.start and not world.down)
    report = decision.report
    memory = published(decision.memory, report)
    world = replace(world, memory=memory, phase=_heard(world.phase, report))
    seen(Step(world, decision.outputs))
    return world


def _switched(world: World, *, on: bool) -> World:
    """Drive the start output. Switching the output on begins a cycle. Switching it off clears
    `done`."""
    begins = on and not world.on and not world.works
    return replace(world, on=on, works=world.works or begins, done=world.done and on and not begins)


def _heard(phase: Phase, report: Any) -> Phase:
    if phase.deaf or phase.outcome or not phase.asks:
        return phase
    listed = GUID in report.queue
    if report.read_at is not None or not phase.stamped:
        phase = replace(phase, stamped=phase.stamped or report.read_at is not None)
        if not phase.acknowledged:
            phase = replace(phase, acknowledged=listed)
        elif not listed:
            return replace(phase, outcome="completed")
    for guid, status in report.results:
        if guid == GUID and status == WorkcellStatus.SUCCESS:
            return replace(phase, outcome="completed")
        if guid == GUID and status == WorkcellStatus.FAILED:
            return replace(phase, outcome="failed")
        phase = replace(phase, acknowledged=True)
    return phase


def _shifted(value: Any, by: float) -> Any:
    """Return the value with all times in it moved back by `by` seconds, but not to before
    -LONGEST_S."""
    if isinstance(value, tuple):
        return tuple(_shifted(one, by) for one in value)
    if not isinstance(value, msgspec.Struct):
        return value
    found: dict[str, Any] = {}
    for name in value.__struct_fields__:
        held = getattr(value, name)
        is_time = name.endswith("_at") or name in ("since", "torn_since")
        if is_time and isinstance(held, float) and math.isfinite(held):
            found[name] = max(held - by, -LONGEST_S)
        else:
            found[name] = _shifted(held, by)
    return type(value)(**found)


WALKER: Walker[World, Move] = Walker(MOVES, TIMES, moved, waited)
