"""One alarm for the fleets of a graph: the messages that one daemon publishes about the causes that its
devices see.

Lifts, doors and panels report their present causes, such as a fire contact that is on. Fleet adapters
stop their robots at a `true`, and resume at any `false`, whoever sent it. So the alarms of all nodes on
the graph act like one alarm. An alarm of another node stands as long as our daemon counts it as not
over.

Rules:
FLEET-ALARM-1. A cause that is present latches, and the daemon's alarm is raised as long as a cause is
   latched. Only a person's reset of this daemon ends a latched cause, and only if its device is read
   and the cause is absent. Causes of a device that is no longer in the YAML may be reset.
FLEET-ALARM-2. A raised alarm is published as `true`, once and at once. The publisher retains that
   message for fleet adapters that start later.
FLEET-ALARM-3. A daemon publishes `false` only under three conditions: it has published `true`, none of
   its causes is latched, and no alarm of another node stands for any of the same fleets. So the alarm
   ends when every cause has ended and every daemon that saw a cause was reset. Each of these daemons
   publishes its own `false`, because the `true` that it retains would stop a fleet adapter that starts
   later.
FLEET-ALARM-4. Another node's alarm stands from its `true` on. It also stands if one of our nodes states
   on `/diagnostics` that its alarm is raised. It stands until that node publishes `false` or states
   that its alarm is over. Silence ends no alarm, because the alarm's source may have died in the fire.
   A `false` of any node also ends all standing alarms, except the alarms of our nodes that still make
   statements. The reason is that RMF has obeyed the `false`, so the robots already drive. In the quiet
   start (the first seconds, in which the daemon only listens) such a `false` may be an old, retained
   one. It then ends only its sender's alarm. Later the transport drops a retained `false` that was
   heard before.
FLEET-ALARM-5. If another node publishes `false` during a raised alarm, `true` is published again, but
   no more often than each AGAIN_S. The contradiction is a fault.
FLEET-ALARM-6. Latched causes, the published `true` and other nodes' alarms survive a restart. After a
   restart a raised alarm is published again, because the retained `true` of the earlier process is
   gone. In the quiet start no `false` is published, because other nodes state their alarms each second.
   A daemon that ends publishes nothing.
FLEET-ALARM-7. A drill raises the alarm without latching, and its end needs no reset. A device asks for
   the drill, or a person orders it for a duration. If a cause comes during a drill, the alarm becomes a
   real alarm, which ends the ordered drill. No drill is ordered during an alarm for one of the same
   fleets. No drill is ordered in the quiet start either, because such an alarm may not have been heard
   yet. A restart ends the ordered drill.
FLEET-ALARM-8. Some transports do not name the sender of a message. Any publisher that is present and is
   not one of our nodes may then have sent it. Until discovery names the sender, the alarm stands under
   the name of an unknown node.
"""

from collections.abc import Collection
from typing import Final

from msgspec.structs import replace

from bridges.kinds.shared.decision import (
    AlarmInputs,
    Decision,
    DrillOrdered,
    Fault,
    OperatorReset,
    Said,
)
from bridges.kinds.shared.durations import AGES_AGO, NEVER, RIVAL_QUIET_S, SILENT_S
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmCause,
    AlarmHeard,
    AlarmNamed,
    AlarmStated,
    DeviceTells,
    FleetAlarmEvent,
    FleetAlarmLimits,
    FleetAlarmMemory,
    FleetAlarmReport,
    Fleets,
    overlap,
)
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.messages.definitions import Bool, EmergencySignal, Message
from bridges.messages.topics import EMERGENCY_SIGNAL, Topic

AGAIN_S: Final = 0.2
"""The least time (s) between two messages `true`. It is needed because another node may publish `false`
without end."""
RENEW_S: Final = 5.0
"""The time (s) after which a retained `false` is withdrawn. By then every node has heard it. Otherwise
a fleet adapter that starts in a later alarm might hear the old `false` last."""
MOST_OTHERS: Final = 200
"""The greatest number of other nodes whose alarms are remembered. A site has some dozens of daemons."""
UNKNOWN: Final = "unknown node"
"""The beginning of the name that a node has until discovery has named it."""
OR: Final = " or "
"""The word between the names of nodes if one of several nodes has sent a message."""


def initial() -> FleetAlarmMemory:
    """Return the memory at the first start: no cause was seen, and nothing was published."""
    return FleetAlarmMemory()


def decide(
    memory: FleetAlarmMemory, event: FleetAlarmEvent, now: float, limits: FleetAlarmLimits
) -> Decision[FleetAlarmMemory, None, FleetAlarmReport]:
    """Apply the event, latch the present causes, and publish the messages that the rules require."""
    if AGES_AGO < memory.drill_until <= now:
        memory = replace(memory, drill_until=AGES_AGO)
    memory, refused = _take(memory, event, now, limits)
    memory = _latch(memory)
    memory, say = _say(memory, now, limits)
    if memory.state != memory.shown:
        memory = replace(memory, shown=memory.state, since=now)
    due = (
        memory.drill_until,
        memory.told_at + AGAIN_S if memory.owed and memory.raised else NEVER,
        memory.contradicted[1] + RIVAL_QUIET_S,
    )
    wake_at = min((at for at in due if at > now), default=NEVER)
    return Decision(memory, None, _report(memory, now), wake_at, refused, say)


def _take(
    memory: FleetAlarmMemory, event: FleetAlarmEvent, now: float, limits: FleetAlarmLimits
) -> tuple[FleetAlarmMemory, str]:
    match event:
        case DeviceTells(device, inputs):
            return replace(memory, inputs={**memory.inputs, device: inputs}), ""
        case AlarmHeard(senders, on, fleets):
            heard = (memory, senders, fleets)
            return _hear_true(*heard) if on else _hear_false(*heard, now), ""
        case AlarmNamed(unknown, senders):
            return _name(memory, unknown, senders), ""
        case AlarmStated():
            return _state(memory, event, now), ""
        case MaySpeak(yes):
            return replace(memory, may_end=yes), ""
        case OperatorReset():
            return _reset(memory, limits)
        case DrillOrdered(for_s):
            return _drill(memory, now + for_s, now, limits)
    return memory, ""


def _hear_true(
    memory: FleetAlarmMemory, senders: Collection[str], fleets: Fleets
) -> FleetAlarmMemory:
    strangers = sorted(node for node in senders if node not in memory.ours)
    if len(senders) > 1 and not strangers:
        return memory  # the sender is one of our nodes, and will state its alarm within a second
    return _stands(memory, OR.join(strangers if len(senders) > 1 else senders), fleets)


def _name(memory: FleetAlarmMemory, unknown: str, senders: Collection[str]) -> FleetAlarmMemory:
    fleets = memory.others.get(unknown)
    if fleets is None:
        return memory
    others = {node: told for node, told in memory.others.items() if node != unknown}
    return _hear_true(replace(memory, others=others), senders, fleets)


def _stands(memory: FleetAlarmMemory, node: str, fleets: Fleets) -> FleetAlarmMemory:
    if len(memory.others) >= MOST_OTHERS and node not in memory.others:
        return memory
    before = memory.others.get(node, fleets)
    both = before | fleets if before and fleets else frozenset[str]()
    return replace(memory, others={**memory.others, node: both})


def _hear_false(
    memory: FleetAlarmMemory, senders: Collection[str], fleets: Fleets, now: float
) -> FleetAlarmMemory:
    live = {node for node, at in memory.ours.items() if now - at <= SILENT_S} - set(senders)
    others = {
        node: told
        for node, told in memory.others.items()
        if node in live or not overlap(told, fleets) or (node not in senders and not memory.may_end)
    }
    memory = replace(memory, others=others)
    if memory.told is None or not overlap(memory.told, fleets):
        return memory
    if not memory.raised:
        return replace(memory, owed=True)
    by = OR.join(sorted(senders))
    return replace(memory, owed=True, contradicted=(by, now))


def _state(memory: FleetAlarmMemory, said: AlarmStated, now: float) -> FleetAlarmMemory:
    if len(memory.ours) >= MOST_OTHERS and said.node not in memory.ours:
        return memory
    ours = {**memory.ours, said.node: now}
    others = {
        nodes: fleets
        for nodes, fleets in memory.others.items()
        if nodes != said.node and (OR not in nodes or not ours.keys() >= {*nodes.split(OR)})
    }
    if said.raised:
        others[said.node] = said.fleets
    return replace(memory, others=others, ours=ours)


def _reset(memory: FleetAlarmMemory, limits: FleetAlarmLimits) -> tuple[FleetAlarmMemory, str]:
    left = tuple(cause for cause in memory.latched if not _is_over(cause, memory, limits))
    why = f"the alarm is not over: {', '.join(map(str, left))}" if left else ""
    return replace(memory, latched=left), why


def _drill(
    memory: FleetAlarmMemory, until: float, now: float, limits: FleetAlarmLimits
) -> tuple[FleetAlarmMemory, str]:
    if until <= now:
        return replace(memory, drill_until=AGES_AGO), ""
    standing = [*map(str, memory.latched), *_standing(memory, limits.fleets)]
    if standing:
        return memory, f"no drill during an alarm: {', '.join(standing)}"
    if not memory.may_end:
        return memory, "no drill yet: this daemon has just started, and listens for alarms"
    return replace(memory, drill_until=until), ""


def _is_over(cause: AlarmCause, memory: FleetAlarmMemory, limits: FleetAlarmLimits) -> bool:
    if cause.device not in limits.devices:
        return True
    inputs = memory.inputs.get(cause.device, AlarmInputs())
    return inputs.seen and cause.signal not in inputs.present


def _latch(memory: FleetAlarmMemory) -> FleetAlarmMemory:
    present = {AlarmCause(d, signal) for d, one in memory.inputs.items() for signal in one.present}
    new = sorted(present.difference(memory.latched))
    if not new:
        return memory
    return replace(memory, latched=(*memory.latched, *new), drill_until=AGES_AGO)


def _say(
    memory: FleetAlarmMemory, now: float, limits: FleetAlarmLimits
) -> tuple[FleetAlarmMemory, tuple[Said, ...]]:
    if memory.raised:
        told = memory.told
        if told is not None and not (memory.owed and now >= memory.told_at + AGAIN_S):
            return memory, ()
        both = limits.fleets if told is None else told | limits.fleets
        fleets = both if limits.fleets and (told is None or told) else frozenset[str]()
        memory = replace(memory, told=fleets, told_at=now, owed=False)
        return memory, (_message(limits.topic, fleets, on=True),)
    if memory.told is None or not memory.may_end or _waits(memory):
        return memory, ()
    over = _message(limits.topic, memory.told, on=False)
    return replace(memory, told=None, ended_at=now, owed=False), (over,)


def _message(topic: Topic[Message], fleets: Fleets, *, on: bool) -> Said:
    if topic.name == EMERGENCY_SIGNAL.name:
        return topic, EmergencySignal(tuple(sorted(fleets)), on)
    return topic, Bool(on)


def _waits(memory: FleetAlarmMemory) -> tuple[str, ...]:
    """Return the nodes whose alarms are not over, for one of the fleets that we have told."""
    return () if memory.told is None else _standing(memory, memory.told)


def _standing(memory: FleetAlarmMemory, told: Fleets) -> tuple[str, ...]:
    """Return the other nodes whose alarms for one of these fleets are not over."""
    return tuple(sorted(node for node, fleets in memory.others.items() if overlap(told, fleets)))


def _report(memory: FleetAlarmMemory, now: float) -> FleetAlarmReport:
    waits = _waits(memory)
    faults = tuple(_faults(memory, waits, now))
    return FleetAlarmReport(memory.state, memory.latched, waits, faults, memory.since)


def _faults(memory: FleetAlarmMemory, waits: tuple[str, ...], now: float) -> list[Fault]:
    found = []
    by, at = memory.contradicted
    if memory.raised and now < at + RIVAL_QUIET_S:
        found.append(
            Fault("ALARM_CONTRADICTED", f"{by} publishes false, while this daemon publishes true")
        )
    if memory.drill:
        found.append(
            Fault("ALARM_DRILL", "the robots are stopped for a drill, which ends by itself")
        )
    elif memory.latched:
        causes = ", ".join(map(str, memory.latched))
        found.append(Fault("ALARM_RAISED", f"the robots are stopped: {causes}"))
    elif memory.told is not None:
        stands = (
            f"the alarm of {', '.join(waits)} is not over"
            if waits
            else "this daemon has just started"
        )
        found.append(Fault("ALARM_WAITS", f"reset here, but {stands}"))
    return found
