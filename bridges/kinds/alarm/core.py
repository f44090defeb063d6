"""The panel's decision core: it finds the causes of an alarm in the panel's readings.

A source is a contact of the panel that reports an alarm. This file only finds the causes.
`bridges/kinds/shared/fleet_alarm.py` latches them, resets them and sends the messages to the fleets, as
for every kind. A panel has no outputs.

Rules:
ALARM-1. A source becomes active when it has been asserted for its debounce time. It is over when it has
   not been asserted for `clear_s`. Until a source has settled for the first time, a single asserted
   reading counts. A failed reading restarts the time `clear_s`, but not the debounce of a begin. A
   source that does not settle within its debounce and `RESTLESS_S` is active too, because a contact
   that chatters may show a fire. If it chatters on, this is a fault.
ALARM-2. After `stale_after_s` without a good reading the panel is silent, which is a fault. Its sources
   keep their last values, and none of them can be reset.
ALARM-3. If the panel is silent for `silent_alarm_after_s`, the silence itself is a cause of an alarm.
   The time counts from the last good reading, or from the start. The next good reading ends that cause.
ALARM-4. A drill begins when the drill contact comes on after it was seen off. It ends `drill_s` later,
   or when the contact goes off. If the contact is already on at the start, no drill begins.
"""

from collections.abc import Iterator

from msgspec.structs import replace

from bridges.kinds.alarm.memory import PanelLimits, PanelMemory
from bridges.kinds.alarm.report import PanelReport
from bridges.kinds.alarm.signals import DRILL, SILENT, Event, PanelOutputs, PanelSample
from bridges.kinds.shared.debounce import Settled, fear, forget, settle, unsteady
from bridges.kinds.shared.decision import AlarmInputs, Decision, Fault, IoFailed, Sampled
from bridges.kinds.shared.durations import AGES_AGO, NEVER


def initial(limits: PanelLimits, now: float) -> PanelMemory:
    """Return the memory at start, before any reading."""
    return PanelMemory(began_at=now)


def decide(
    memory: PanelMemory, event: Event, now: float, limits: PanelLimits
) -> Decision[PanelMemory, PanelOutputs, PanelReport]:
    """Apply one event and decide. `now`: monotonic s, never earlier than in the last call. Never
    raises."""
    match event:
        case Sampled(sample):
            memory = _read(memory, sample, now, limits)
        case IoFailed(reason):
            kept = {name: forget(old, hazard=True) for name, old in memory.sources.items()}
            memory = replace(memory, io_fault=reason, sources=kept, drill=forget(memory.drill))
    wake_at = min((at for at in _wakes(memory, limits) if at > now), default=NEVER)
    return Decision(memory, PanelOutputs(), _report(memory, now, limits), wake_at)


def _read(memory: PanelMemory, sample: PanelSample, now: float, limits: PanelLimits) -> PanelMemory:
    sources = {}
    for name, on in sample.sources.items():
        before = memory.sources.get(name)
        settled = settle(before, on, now, _hold_s(name, before, on, limits))
        sources[name] = fear(settled, now, limits.debounce.get(name, 0.0))
    drill = settle(memory.drill, sample.drill, now, limits.debounce.get(DRILL, 0.0))
    was, until = memory.drill.value if memory.drill else None, memory.drill_until
    if drill.value and was is False:
        until = now + limits.drill_s
    elif was and not drill.value:
        until = AGES_AGO
    return replace(
        memory,
        began_at=now,
        read_at=now,
        sources=sources,
        drill=drill,
        drill_until=until,
        io_fault="",
    )


def _hold_s(name: str, before: Settled[bool] | None, on: bool, limits: PanelLimits) -> float:
    """Return the time (s) for which the value `on` must last before it counts. This is `clear_s` for
    the end of an active source, and the debounce otherwise."""
    over = before is not None and before.value is True and not on
    return limits.t.clear_s if over else limits.debounce.get(name, 0.0)


def _chatters_at(name: str, source: Settled[bool], limits: PanelLimits) -> float:
    """Return the time when the source has kept changing for so long that even its end would have
    settled."""
    return source.restless_at(max(limits.debounce.get(name, 0.0), limits.t.clear_s))


def _is_active(source: Settled[bool]) -> bool:
    return source.candidate if source.value is None else source.value


def _report(memory: PanelMemory, now: float, limits: PanelLimits) -> PanelReport:
    active = tuple(sorted(name for name, one in memory.sources.items() if _is_active(one)))
    sources = sorted(memory.sources.items())
    restless = [name for name, one in sources if now >= _chatters_at(name, one, limits)]
    fresh = memory.read_at is not None and now < memory.read_at + limits.t.stale_after_s
    silent = now >= memory.began_at + limits.silent_alarm_after_s
    present = frozenset((*active, *((SILENT,) if silent else ())))
    steady = all(one.value is not None for one in memory.sources.values())
    drill = now < memory.drill_until
    return PanelReport(
        read_at=memory.read_at,
        active=active,
        silent=not fresh and (memory.read_at is not None or bool(memory.io_fault)),
        faults=tuple(_faults(memory, active, restless, fresh, silent, drill)),
        alarm=AlarmInputs(present, fresh and steady, drill),
    )


def _faults(
    memory: PanelMemory,
    active: tuple[str, ...],
    restless: list[str],
    fresh: bool,
    silent: bool,
    drill: bool,
) -> Iterator[Fault]:
    if active:
        yield Fault("ALARM_SOURCE_ACTIVE", ", ".join(active))
    if fresh and restless:
        yield Fault("HAZARD_INPUTS_UNSTEADY", unsteady(restless))
    if not fresh and (memory.io_fault or silent or memory.read_at is not None):
        yield Fault("PANEL_SILENT", memory.io_fault or "no reading")
    if drill:
        yield Fault("ALARM_DRILL", "a drill, which ends by itself")


def _wakes(memory: PanelMemory, limits: PanelLimits) -> Iterator[float]:
    """Yield each time at which the decision may change without an event."""
    for name, one in memory.sources.items():
        yield one.due_at(_hold_s(name, one, one.candidate, limits))
        yield one.restless_at(limits.debounce.get(name, 0.0))
        yield _chatters_at(name, one, limits)
    if memory.drill is not None:
        yield memory.drill.due_at(limits.debounce.get(DRILL, 0.0))
    yield memory.drill_until
    yield memory.began_at + limits.silent_alarm_after_s
    if memory.read_at is not None:
        yield memory.read_at + limits.t.stale_after_s
