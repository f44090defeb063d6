"""The service of a daemon. It serves either devices on buses, or a kind without hardware, such as a
supervisor.

In both cases the service has threads, subscribes to RMF's topics, and reports a status.
"""

import logging
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, Final, Protocol

from bridges.kinds import kind_called
from bridges.kinds.shared.alarming import alarm_topics
from bridges.kinds.shared.decision import (
    Attended,
    DecidedByPerson,
    DrillOrdered,
    OperatorReset,
    OrderedByPerson,
    RequestRefused,
    RivalSeen,
)
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.kinds.shared.kind import AnyDeviceKind
from bridges.messages.definitions import Message
from bridges.messages.topics import M_co, Topic
from bridges.messages.words import LONGEST_NAME
from bridges.runtime.clock import Clock
from bridges.runtime.device import AnyNode, Node
from bridges.runtime.device_memory import AlarmMemory, DeviceMemories
from bridges.runtime.diagnostics import BUSES
from bridges.runtime.fleet_alarm import FleetAlarmNode, node_for
from bridges.runtime.graph_node import AnyGraphNode, GraphNode
from bridges.runtime.keeper import MemoryStore
from bridges.runtime.loop import Loop
from bridges.runtime.other_bus import Handover, InputReader, taken
from bridges.runtime.outlet import Named, Outlet
from bridges.runtime.predecessor import SafeFirst
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.serving import Rounds, Serving
from bridges.runtime.subject import AnySubject, Status, refusals_of
from bridges.settings.load import Config
from bridges.system.log import pairs
from bridges.system.machine_time import machine_s
from bridges.transports.transport import Subscription, Transport
from drivers import TakesInputs
from drivers.hal import Bus
from drivers.hal.points import Points

log = logging.getLogger(__name__)

FIRST_S: Final = 0.5
"""The time (s) for which a device's first scan waits for a first reading of inputs on another bus."""

NOBODY_OBEYS: Final = (
    "no device of this file obeys this order: a drill needs a device with `alarm`, a decision needs a"
    " workcell, and a supervisor or coordinator is reset as a whole"
)

OpenBus = Callable[[str], Bus]


class Service(Protocol):
    """The service of one YAML."""

    @property
    def loops(self) -> Sequence[Serving]:
        """The service's threads."""

    def subscribe(self) -> None:
        """Subscribe to RMF's topics."""

    def obey(self, order: OrderedByPerson, device: str = "") -> None:
        """Pass on a person's order to one device, or to every device ("")."""

    def refusals(self) -> Mapping[str, str] | None:
        """Return the devices that have refused the last order, with their reasons. Return None until
        every device has decided about the order."""

    def look(self) -> None:
        """Look for other nodes on the graph. The daemon calls this method each second."""

    def status(self) -> Status:
        """Return the status of the whole service, for the status file."""

    def devices(self) -> Mapping[str, Status]:
        """Return the status of each device by name, for the status file. A supervisor's devices are its
        lifts or doors."""


def named_by(config: Config, topic: Topic[M_co]) -> Topic[M_co]:
    """Return the topic under its name in the YAML, if the YAML renames the topic."""
    return topic.named(config.rmf.topics.get(topic.name, topic.name))


def clock_of(transport: Transport) -> Clock:
    """Return a clock for durations and stamps. Durations come from the machine's clock, and stamps from
    RMF's clock."""
    return Clock(machine_s, transport.wall)


def service(
    config: Config,
    transport: Transport,
    open_bus: OpenBus,
    kept: MemoryStore | None = None,
    unsafe: Collection[str] = (),
    writer: NoWriter = NOBODY,
    *,
    new: bool = False,
    rmf: Any = None,
) -> Service:
    """Return the service for this YAML. Raises HalError if a bus cannot be opened.

    - `kept`: the store for the memory that survives restarts, or None. Not every kind has such a
      memory.
    - `new`: Does a missing file mean that the devices have never run before?
    - `unsafe`: the devices that a dead daemon may have left on
    - `writer`: the writer of the recording
    - `rmf`: an object that replaces RMF's fleet adapter in a simulation, or None for the real adapter
    """
    kind = kind_called(config.kind)
    named = partial(named_by, config)
    clock = clock_of(transport)
    if isinstance(kind, GraphKind):
        node = GraphNode(kind, config.section, transport, clock, named, kept, writer)
        return GraphService(node, clock)
    memories = DeviceMemories(kept, new=new) if kept is not None else None
    if kind.section:
        from bridges.runtime.fleet.service import FleetDevices

        return FleetDevices(
            config, kind, transport, open_bus, named, clock, unsafe, writer, memories, rmf=rmf
        )
    alarms = AlarmMemory(memories) if memories is not None else None
    alarm = node_for(config.devices, transport, clock, named, alarms, writer)
    return Devices(config, kind, transport, open_bus, named, clock, unsafe, writer, alarm, memories)


class GraphService:
    """The service of a supervisor or coordinator. It has one thread and no bus."""

    def __init__(self, node: AnyGraphNode, clock: Clock) -> None:
        self.loops = [Serving(node, clock)]
        self.subscribe = node.subscribe
        self.status = node.status
        self.devices = node.devices
        self._node = node
        self._order: OperatorReset | None = OperatorReset()

    def obey(self, order: OrderedByPerson, device: str = "") -> None:
        """Pass on a reset of the whole service. Ignore other orders, because no kind without hardware
        obeys them."""
        self._order = None if device or not isinstance(order, OperatorReset) else order
        if self._order is not None:
            self._node.obey(self._order)

    def refusals(self) -> Mapping[str, str] | None:
        """Return the reasons for which subjects have refused the last order. Return None until every
        subject has decided about the order."""
        if self._order is None:
            return {"": NOBODY_OBEYS}
        return refusals_of(self._order, list(self._node.subjects.values()))

    def look(self) -> None:
        """Do nothing, because the node itself looks for other nodes."""


class Devices:
    """The service of lifts, doors, chargers or workcells. Each bus has a loop with its own thread, and
    each device has a node."""

    def __init__(
        self,
        config: Config,
        kind: AnyDeviceKind,
        transport: Transport,
        open_bus: OpenBus,
        named: Named,
        clock: Clock,
        unsafe: Collection[str] = (),
        writer: NoWriter = NOBODY,
        alarm: FleetAlarmNode | None = None,
        memories: DeviceMemories | None = None,
    ) -> None:
        """Prepare the service. `alarm`: the node that tells the fleets of the devices' alarms, or None
        if no device raises alarms."""
        self._config = config
        self._alarm = alarm
        self._memories = memories
        self._writer = writer
        self._unsafe = unsafe
        self._kind = kind
        self._transport = transport
        self._clock = clock
        self._named = named
        self._strangers: Counter[str] = Counter()
        self._outlet = Outlet(transport, named, writer)
        self._outlet.open(self._topics())
        self._hears: dict[str, Subscription] = {}
        self._ordered: tuple[OrderedByPerson, list[AnySubject]] = (OperatorReset(), [])
        self._attended: bool | None = None
        self._handovers = {
            (device, bus): Handover(bus, config.lasts_s(bus), clock)
            for device in config.devices
            for bus in config.other_buses(device)
        }
        self._placed: dict[str, tuple[AnyNode, Loop]] = {}
        self._loops = [self._loop(name, open_bus) for name in config.buses]
        served: list[Rounds] = [*self._loops, *([alarm] if alarm else [])]
        self.loops = [Serving(each, clock) for each in served]
        for (device, _), handover in self._handovers.items():
            handover.changed = self._placed[device][1].stir

    def subscribe(self) -> None:
        """Subscribe to requests, and to topics that are only recorded. Also subscribe to our devices'
        states, because a rival node may publish them."""
        for topic, accept in self._kind.requests.items():
            hear = self._to_inbox(topic, accept)
            self._hears[topic.name] = self._transport.subscribe(self._named(topic), hear)
        for topic in self._kind.recorded:
            self._transport.subscribe(self._named(topic), partial(self._record, self._named(topic)))
        if states := self._kind.states:
            hear = self._to_inbox(states, lambda state, settings: RivalSeen())
            self._transport.subscribe(self._named(states), hear, others_only=True)
        if self._alarm:
            self._alarm.subscribe()

    def obey(self, order: OrderedByPerson, device: str = "") -> None:
        """Pass on an order. A drill goes to the alarm, and a decision goes to the workcells. A reset
        goes to the alarm and to all devices, or only to the one device."""
        subjects: list[AnySubject] = []
        if self._alarm and not device and not isinstance(order, DecidedByPerson):
            self._alarm.obey(order)
            subjects += self._alarm.subjects.values()
        decides = self._kind.decided_by_person or not isinstance(order, DecidedByPerson)
        if decides and not isinstance(order, DrillOrdered):
            for name, (node, loop) in self._placed.items():
                if device in ("", name):
                    loop.inbox.put(name, order)
                    subjects.append(node.subject)
        self._ordered = order, subjects

    def refusals(self) -> Mapping[str, str] | None:
        """Return the reasons for which devices have refused the last order. Return None until every
        device has decided about the order."""
        order, subjects = self._ordered
        return refusals_of(order, subjects) if subjects else {"": NOBODY_OBEYS}

    def look(self) -> None:
        """Tell each device whether any node can send requests, when this changes."""
        if self._alarm:
            self._alarm.look()
        topic = self._kind.attended_by
        if topic is None:
            return
        attended = self._hears[topic.name].matched() > 0
        if attended == self._attended:
            return
        self._attended = attended
        for device, (_, loop) in self._placed.items():
            loop.inbox.put(device, Attended(attended))

    def status(self) -> Status:
        """Return the service's status, for the status file."""
        shown = {
            "requests_for_others": self._strangers["requests"],
            "events_dropped": sum(loop.inbox.dropped for loop in self._loops),
            "faults": [{"code": f.code, "detail": f.detail} for f in self._outlet.faults],
            "heard_by": self._outlet.heard_by(),
            "hears": {name: end.matched() for name, end in self._hears.items()},
            BUSES: {loop.bus_name: loop.calls() for loop in self._loops},
        }
        return self._alarm.beside(shown) if self._alarm else shown

    def devices(self) -> Mapping[str, Status]:
        """Return each device's status, for the status file."""
        return {name: node.status() for name, (node, _) in self._placed.items()}

    def _topics(self) -> list[Topic[Message]]:
        others = {t for d in self._config.devices.values() for t in self._kind.publishes(d)}
        return [*self._kind.stated_on, *others]

    def _loop(self, bus_name: str, open_bus: OpenBus) -> Loop:
        settings = self._config.buses[bus_name]
        bus = open_bus(bus_name)
        nodes = [self._node(name, bus) for name in self._config.devices_on(bus_name)]
        readers = [
            self._reader(device, bus_name, bus, handover)
            for (device, name), handover in self._handovers.items()
            if name == bus_name
        ]
        both: list[AnyNode | InputReader] = [*nodes, *readers]
        loop = Loop(bus_name, bus, both, settings.scan_s, self._clock, self._writer)
        self._placed.update({node.name: (node, loop) for node in nodes})
        return loop

    def _reader(self, device: str, bus_name: str, bus: Any, to: Handover) -> InputReader:
        points = Points(self._config.wires_on(bus_name, device), bus)
        return InputReader(device, bus_name, points, to, self._clock)

    def _node(self, name: str, bus: Bus) -> AnyNode:
        device = self._config.devices[name]
        driver_type = self._config.driver_type(name)
        limits = self._kind.limits(device, self._config.debounce(name))
        driver = driver_type.create(name, device, bus)
        handovers = [one for (owner, _), one in self._handovers.items() if owner == name]
        if handovers:
            assert isinstance(driver, TakesInputs)  # `bus` is a key of contacts only
            driver.take_inputs(partial(taken, handovers))
        if name in self._unsafe:
            driver = SafeFirst(name, driver)
        out, clock, writer = self._outlet, self._clock, self._writer
        tell = self._alarm.tell if self._alarm and alarm_topics(device) else None
        node: AnyNode = Node(
            name, self._kind, device, limits, driver, out.publish, clock, writer, out.failed, tell,
            self._memories,
        )  # fmt: skip
        if handovers:
            node.wake_at = clock.monotonic() + FIRST_S
        return node

    def _to_inbox(
        self, topic: Topic[Message], accept: Callable[[Any, Any], object]
    ) -> Callable[[Message], None]:
        """Return a callback for the transport's thread. The callback puts messages about our devices
        into the inbox, and counts requests for other devices."""
        states = topic == self._kind.states
        heard_on = self._named(topic)

        def put(message: Message) -> None:
            device = self._kind.device_name(message)
            if device in self._placed:
                self._record(heard_on, message)
                node, loop = self._placed[device]
                try:
                    event = accept(message, self._config.devices[device])
                except RequestRefused as refusal:
                    node.refuse(message, refusal)
                else:
                    sender = "" if states else self._kind.sender(message)
                    loop.inbox.put(device, event, (topic.name, sender))
            elif not states:
                self._count_stranger(device)

        return put

    def _record(self, topic: Topic[Message], message: Message) -> None:
        """Record a message about one of our devices. Only the transport's callback calls this
        method."""
        if self._kind.device_name(message) in self._placed:
            sender = self._transport.sender()
            self._writer.spoken(topic.name, message, sent=False, sender=sender)

    def _count_stranger(self, device: str) -> None:
        if not self._strangers:
            log.info(pairs("not_ours", kind=self._kind.name, name=device[:LONGEST_NAME]))
        self._strangers["requests"] += 1
