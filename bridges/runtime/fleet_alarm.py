"""Serves the alarm that a daemon's devices raise to stop the robots of fleets. The alarm has its own
thread.

The devices' threads put the causes that they see into this node's inbox. So a slow disk delays no scan
of a device. The alarm's memory is written to disk before a message is published (`keeper.py`).
"""

import logging
import math
import threading
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Final

from bridges.kinds.shared import alarming, fleet_alarm, kept_alarm
from bridges.kinds.shared.decision import AlarmInputs, Fault
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.fields import GraphSettings
from bridges.kinds.shared.fleet_alarm import RENEW_S, UNKNOWN
from bridges.kinds.shared.fleet_alarm_memory import (
    AlarmNamed,
    DeviceTells,
    FleetAlarmEvent,
    FleetAlarmLimits,
    FleetAlarmMemory,
    FleetAlarmReport,
)
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.messages.definitions import DiagnosticArray, EmergencySignal, Message, Time
from bridges.messages.heard import Sender
from bridges.messages.topics import DIAGNOSTICS, Topic
from bridges.runtime.clock import Clock
from bridges.runtime.graph_node import GraphNode
from bridges.runtime.keeper import MemoryStore
from bridges.runtime.outlet import Named
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.subject import Status
from bridges.system.log import pairs
from bridges.transports.transport import Transport, any_type

log = logging.getLogger(__name__)

QUIET_S: Final = 3.0
"""The silence (s) after which another node of ours counts as dead. A node states its alarm each second,
so three statements are missing."""
MOST_UNNAMED: Final = 200
"""The number of senders whose names are still sought. Anybody can publish an alarm and leave without a
name."""
ALARM: Final = "alarm"
"""The name of this node's only subject, which is the alarm itself."""


class MessagesOnly(NoWriter):
    """A writer that records only messages, and no decisions. A recording has the entries of the
    daemon's own kind, and the alarm's decisions do not fit into such entries."""

    def __init__(self, writer: NoWriter) -> None:
        self._writer = writer

    def spoken(
        self, topic: str, message: Message, *, sent: bool, sender: Sender | None = None
    ) -> None:
        """Note a message that was sent or heard."""
        self._writer.spoken(topic, message, sent=sent, sender=sender)


def _kind(limits: FleetAlarmLimits) -> "AlarmKind":
    return GraphKind(
        name="fleet_alarm",
        devices_key=ALARM,
        settings=GraphSettings,
        requests={},
        publishes=(limits.topic,),
        sole=(),
        device_name=lambda message: ALARM,
        quiet_s=lambda settings: QUIET_S,
        limits=lambda settings: limits,
        initial=lambda name, started_at: fleet_alarm.initial(),
        decide=fleet_alarm.decide,
        stamped=_without_stamp,
        summary=lambda report, now: alarming.statement(report, limits.fleets),
        idle=lambda memory, now: False,
        persist=lambda memories: kept_alarm.persist(memories[ALARM]),
        restore=lambda kept, settings, now: {ALARM: kept_alarm.restore(kept)},
    )


def _without_stamp(message: Message, at: Time) -> Message:
    return message


AlarmKind = GraphKind[
    GraphSettings, FleetAlarmLimits, FleetAlarmMemory, FleetAlarmEvent, FleetAlarmReport
]


class FleetAlarmNode(
    GraphNode[GraphSettings, FleetAlarmLimits, FleetAlarmMemory, FleetAlarmEvent, FleetAlarmReport]
):
    """The alarm of one daemon.

    `tells_nobody`: Is nothing published if RMF's release has no alarm message that can name fleets?
    """

    def __init__(
        self,
        limits: FleetAlarmLimits,
        transport: Transport,
        clock: Clock,
        named: Named,
        kept: MemoryStore | None = None,
        writer: NoWriter = NOBODY,
        *,
        tells_nobody: bool = False,
    ) -> None:
        self._limits = limits
        self._tells_nobody = tells_nobody
        self._renew_at = NEVER
        self._untold = False
        self._twin_at = -math.inf
        self._counted = 0
        self._unnamed: dict[str, tuple[Sender | None, str]] = {}
        self._naming = threading.Lock()  # the transport's thread and the main thread use `_unnamed`
        super().__init__(
            _kind(limits), GraphSettings(), transport, clock, named, kept, MessagesOnly(writer)
        )
        if ALARM not in self.subjects:
            self._add(ALARM, fleet_alarm.initial())

    def tell(self, device: str, inputs: AlarmInputs) -> None:
        """Note the causes for an alarm that a device sees now. Any thread may call this method.

        A short alarm that comes and goes before the next round stays in the inbox, because it latches.
        """
        tells = DeviceTells(device, inputs)
        self.inbox.put(ALARM, (self._limits.topic, tells), tells)

    def subscribe(self) -> None:
        """Subscribe to other nodes' statements, and to their alarms on each topic that RMF's release
        has."""
        hear = any_type(self._on_statement)
        self._transport.subscribe(self._named(DIAGNOSTICS), hear, others_only=True)
        self.look()

    def look(self) -> None:
        """Subscribe to the alarm topics that RMF's release has, if they are not yet subscribed. The
        daemon calls this method each second, because RMF may be upgraded to another release."""
        self._name_senders()
        for topic in alarming.TOPICS.values():
            if topic.name not in self._hears and self._transport.release.has(topic.type):
                hear = self._on_alarm(topic)
                name = self._named(topic)
                self._hears[topic.name] = self._transport.subscribe(name, hear, others_only=True)

    def round(self) -> None:
        """Run one round, as every node does. Also withdraw the message `false` that ended an alarm,
        RENEW_S after its publication. By then every node has heard this retained message."""
        super().round()
        memory, now = self.subjects[ALARM].memory, self._clock.monotonic()
        if memory.told is not None:
            self._renew_at = NEVER
        elif now - memory.ended_at < RENEW_S:
            self._renew_at = memory.ended_at + RENEW_S
        elif now >= self._renew_at:
            self._renew_at = NEVER
            self._outlet.close()
            self._outlet.open(self._kind.publishes)

    @property
    def wake_at(self) -> float:
        """The time of the next round if no message arrives (monotonic s)."""
        return min(super().wake_at, self._renew_at)

    def beside(self, status: Status) -> Status:
        """Return `status` together with the alarm's statement, faults and connections. Any thread may
        call this method."""
        decision, own = self.subjects[ALARM].decision, self.status()
        assert decision is not None  # a new subject decides at once
        statement = alarming.statement(decision.report, self._limits.fleets)
        if (since := decision.report.since) is not None:
            wall = self._clock.wall() - (self._clock.monotonic() - since)
            statement["since"] = f"{datetime.fromtimestamp(round(wall), UTC):%Y-%m-%dT%H:%M:%SZ}"
        return {
            **status,
            ALARM: statement,
            **{key: [*own[key], *status[key]] for key in ("faults",)},
            **{key: {**status[key], **own[key]} for key in ("heard_by", "hears")},
            "refused": own["refused"],
        }

    def _faults(self) -> tuple[Fault, ...]:
        decision = self.subjects[ALARM].decision
        found = decision.report.faults if decision else ()
        return *found, *super()._faults(), *self._not_told(), *self._twin()

    def _twin(self) -> tuple[Fault, ...]:
        if self._clock.monotonic() - self._twin_at > QUIET_S:
            return ()
        text = f"another daemon is {self._transport.name} too: neither hears the other one's alarm"
        return (Fault("TWO_NODES_OF_ONE_NAME", text),)

    def _not_told(self) -> tuple[Fault, ...]:
        if not self._untold:
            return ()
        text = (
            "RMF's release has no emergency_signal, and the YAML says without_fleets: tell_nobody"
        )
        return (Fault("ALARM_NOT_TOLD", text),)

    def _publish(self, topic: Topic[Message], message: Message) -> None:
        lacks = not self._transport.release.has(topic.type)
        self._untold = self._tells_nobody and lacks and _is_on(message)
        if not (self._tells_nobody and lacks):
            super()._publish(topic, message)

    def _on_alarm(self, topic: Topic[Message]) -> Callable[[Message], None]:
        def put(message: Message) -> None:
            sender = self._transport.sender()
            names = self._names(sender, topic.name)
            with self._naming:
                event = alarming.heard(message, names or [self._unknown(sender, topic.name)])
                if event.senders == {self._transport.name}:  # by our earlier run
                    return
                self.inbox.put(ALARM, (topic, event))
            self._writer.spoken(self._named(topic).name, message, sent=False, sender=sender)

        return put

    def _names(self, sender: Sender | None, topic: str) -> list[str]:
        """Return the nodes that may have sent a message. Return nothing until discovery knows these
        nodes."""
        if sender is not None:
            node = sender.node or (sender.look() if sender.look else "")
            return [node] if node else []
        hears = self._hears.get(topic)
        return hears.senders() if hears else []

    def _unknown(self, sender: Sender | None, topic: str) -> str:
        """Return a provisional name for an unknown sender. Each second, `look` tries to find the
        sender's real name."""
        for name, (known, on) in self._unnamed.items():
            if known is sender and on == topic:
                return name
        self._counted += 1
        name = f"{UNKNOWN} {self._counted}"
        self._unnamed[name] = (sender, topic)
        if len(self._unnamed) > MOST_UNNAMED:
            del self._unnamed[next(iter(self._unnamed))]
        return name

    def _name_senders(self) -> None:
        with self._naming:
            unnamed = list(self._unnamed.items())
        for unknown, (sender, topic) in unnamed:
            if names := self._names(sender, topic):
                named = AlarmNamed(unknown, frozenset(name.lstrip("/") for name in names))
                with self._naming:
                    self._unnamed.pop(unknown, None)
                    self.inbox.put(ALARM, (self._limits.topic, named))

    def _on_statement(self, message: DiagnosticArray) -> None:
        for event in alarming.stated(message):
            if event.node == self._transport.name:  # not ours, because of `others_only`
                if not self._twin():
                    log.error(pairs("two_nodes_of_one_name", node=event.node))
                self._twin_at = self._clock.monotonic()
            else:
                self.inbox.put(ALARM, (DIAGNOSTICS, event), ("stated", event.node))


def _is_on(message: Message) -> bool:
    return isinstance(message, EmergencySignal) and message.is_emergency


def node_for(
    devices: Mapping[str, object],
    transport: Transport,
    clock: Clock,
    named: Named,
    kept: MemoryStore | None,
    writer: NoWriter,
) -> FleetAlarmNode | None:
    """Return the alarm node of a file. Return None if no device of the file raises an alarm for
    fleets."""
    alarms = {n: one for n, one in devices.items() if isinstance(one, alarming.AlarmingSettings)}
    limits = alarming.alarm_limits(alarms)
    if limits is None:
        return None
    nobody = any(one.without_fleets == "tell_nobody" for one in alarms.values())
    log.info(pairs("alarm", topic=limits.topic.name, fleets=sorted(limits.fleets) or "all"))
    return FleetAlarmNode(limits, transport, clock, named, kept, writer, tells_nobody=nobody)
