"""The daemons of the site: a node for each device, and the supervisors. Each can die and start again.

A daemon scans its device at each request, at its core's `wake_at`, and SCANS_BEFORE_S before the last
reading would be stale. A change of a contact also causes a scan. On a bus with polling this scan comes
one poll period later.

Between these times no input changes and no time limit passes, so a scan would repeat the last decision.
Therefore a daemon here need not scan 20 times per second, as the real loop does. The tests of the cores
prove that no decision changes before `wake_at`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

from bridges.kinds.shared.decision import OperatorReset, RivalSeen
from bridges.kinds.shared.graph_kind import AnyGraphKind
from bridges.messages.definitions import Message
from bridges.messages.heard import Sender
from bridges.messages.topics import DOOR_REQUESTS, DOOR_SUPERVISOR_HEARTBEAT, LIFT_REQUESTS, Topic
from bridges.runtime.clock import Clock
from bridges.runtime.device import AnyNode, Node
from bridges.runtime.device_memory import DeviceMemories
from bridges.runtime.graph_node import AnyGraphNode, GraphNode
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.subject import Status
from bridges.transports.transport import Publisher
from hal_fakes.plants.plant import Edge
from tests.accepted import accepted
from tests.runtime.virtual_graph import Disk
from tests.site.building import Device
from tests.site.network import Air, Place
from tests.site.timeline import EPOCH, NEVER, Alarm, Timeline
from workbench.rmf_model.supervisors import DoorSupervisor, LiftSupervisor

SCANS_BEFORE_S = 0.1
"""The time (s) from a daemon's scan to the time at which its last reading would be stale. The core's
`wake_at` also makes the daemon publish one state per second."""
STALE_S = 1.0
"""The time (s) after which a reading of a kind without `stale_after` counts as stale."""
LEAST_GAP_S = 0.001


class DeviceDaemon:
    """The daemon of one device. `wall_step_s` is the error of its wall clock (s). `node` is its name on
    the graph, by default the device's name.

    Tests set these callbacks:
    - `looks` runs before each change of the plant and before each scan. It gets the time.
    - `scanned` runs after each scan.
    - `relayed` gets each edge of a relay.
    - `started` runs at the start.
    - `hears` gets each message that arrives.
    """

    def __init__(self, timeline: Timeline, air: Air, device: Device, node: str = "") -> None:
        self.name = device.name
        self.node = node or device.name
        self.device = device
        self.alive = False
        self.scans = 0
        self.refused: Counter[str] = Counter()
        self.wall_step_s = 0.0
        self.looks: Callable[[DeviceDaemon, float], None] = lambda daemon, at: None
        self.scanned: Callable[[DeviceDaemon], None] = lambda daemon: None
        self.relayed: Callable[[Edge], None] = lambda edge: None
        self.writer: NoWriter = NOBODY
        self.disk = Disk()
        self.started: Callable[[DeviceDaemon], None] = lambda daemon: None
        self.hears: Callable[[DeviceDaemon, Topic[Any], Any], None] = lambda daemon, topic, told: (
            None
        )
        self._changed = False
        self._scan_s = (device.settings.stale_after() or STALE_S) - SCANS_BEFORE_S
        device.plant.on_edge = self._edge
        self._timeline = timeline
        self._air = air
        self._alarm = Alarm(timeline, self.scan)
        self._publishers: dict[str, Publisher[Any]] = {}
        self._node: AnyNode
        self._place: Place

    def start(self) -> None:
        """Start a new daemon, which remembers only what is on its `disk`."""
        self.started(self)
        device, kind = self.device, self.device.kind
        self._place = Place(self._air, self.node, lambda: None)
        topics = [*kind.stated_on, *kind.publishes(device.settings)]
        self._publishers = {topic.name: self._place.publisher(topic) for topic in topics}
        limits = kind.limits(device.settings, device.debounce)
        clock = Clock(
            lambda: self._timeline.now, lambda: EPOCH + self._timeline.now + self.wall_step_s
        )
        self._node = Node(
            self.name,
            kind,
            device.settings,
            limits,
            device.driver(),
            self._publish,
            clock,
            self.writer,
            memories=DeviceMemories(self.disk, new=True),
        )
        self.alive = True
        subscribe = partial(self._place.subscribe_to, self.name, kind.device_name)
        for topic in (*kind.requests, *kind.recorded):
            subscribe(topic, partial(self._hear, topic))
        for topic in kind.stated_on:
            subscribe(topic, partial(self._hear, topic), others_only=True)
        self.scan()

    def kill(self) -> None:
        """Kill the daemon, and switch the outputs off. In reality a dying daemon or `rmf-bridge
        outputs-off` does that."""
        self.alive = False
        self._alarm.set(NEVER)
        self._node.make_safe()
        self._place.close()
        self.refused.update(self._node.refused)

    def reset(self) -> bool:
        """Reset the daemon as `rmf-bridge reset` does. Return whether no fire is latched afterwards. A
        lift whose inputs are not read yet keeps its latch."""
        if self.alive:
            self.scan(OperatorReset())
        return "FIRE_LATCHED" not in self.faults()

    def scan(self, *events: Any) -> None:
        """Give the core these events, and scan once."""
        if not self.alive:
            return
        now = self._timeline.now
        self.advance()
        self._changed = False
        self._node.scan(events)
        self.writer.flush()
        self.scans += 1
        self.scanned(self)
        changes_at = (now if self._changed else self.device.plant.next_at()) + self.device.poll_s
        due = min(self._node.wake_at, changes_at, now + self._scan_s)
        self._alarm.set(max(due, now + LEAST_GAP_S))

    def advance(self) -> None:
        """Let the plant run until now. Stop at each event of the plant to call `looks`."""
        plant, now = self.device.plant, self._timeline.now
        while (at := plant.next_at()) < now:
            self.looks(self, at)
            plant.advance(at)
        self.looks(self, now)
        plant.advance(now)
        self.looks(self, now)

    def look(self) -> None:
        """Scan after a change of the plant, at once or at the next poll."""
        self._timeline.after(self.device.poll_s, self.scan)

    def status(self) -> Status:
        """Return the status that the daemon writes to its status file."""
        return self._node.status()

    def says(self, topic: Topic[Any], message: Message) -> None:
        """Publish this message, in addition to the node's own messages."""
        self._place.publisher(topic).publish(message)

    def faults(self) -> list[str]:
        """Return the codes of the faults in the status."""
        return [fault["code"] for fault in self.status()["faults"]] if self.alive else []

    def _edge(self, edge: Edge) -> None:
        """Pass an edge of the plant on. Clear the plant's own list of edges, because nobody reads
        it."""
        self.device.plant.edges.clear()
        if edge.what == "relay":
            self.relayed(edge)
        else:
            self._changed = True

    def _hear(self, topic: Topic[Any], message: Any) -> None:
        self.hears(self, topic, message)
        if self.device.kind.device_name(message) != self.name:
            return
        sender = self._place.sender()
        self.writer.spoken(topic.name, message, sent=False, sender=sender)
        if topic in self.device.kind.recorded:
            return
        kind, settings = self.device.kind, self.device.settings
        if topic == kind.states:
            self.scan(RivalSeen())
            return
        for event in accepted(self._node, kind, settings, (topic, message)):
            self.scan(event)

    def _publish(self, topic: Topic[Any], message: Message) -> None:
        self._publishers[topic.name].publish(message)
        self.writer.spoken(topic.name, message, sent=True, sender=Sender(f"/{self.node}"))


RIVAL = "rmf_lift_supervisor"


class RmfsSupervisor:
    """A stand-in for RMF's own supervisor. It replaces our supervisor, or wrongly runs beside it."""

    def __init__(
        self,
        timeline: Timeline,
        air: Air,
        name: str,
        made: Callable[[], LiftSupervisor | DoorSupervisor],
        says: Iterable[Topic[Any]],
    ) -> None:
        self.name = name
        self.alive = False
        self._timeline = timeline
        self._air = air
        self._made = made
        self._says = list(says)
        self._place: Place
        air.best_effort.add(name)
        air.unrepeated.add(name)

    def start(self) -> None:
        """Start a new supervisor. It remembers nothing, and hears all retained messages."""
        self._place = Place(self._air, self.name, lambda: None)
        self._party = self._made()
        self._mouths = {topic.name: self._place.publisher(topic) for topic in self._says}
        self.alive = True
        for topic in self._party.subscribes:
            self._place.subscribe(topic, self._hear)

    def kill(self) -> None:
        """Stop the supervisor, which leaves the graph."""
        self.alive = False
        self._place.close()

    def summary(self) -> Mapping[str, Status]:
        """Return nothing, because RMF's supervisors have no status."""
        return {}

    def _hear(self, message: Any) -> None:
        for topic, said in self._party.hear(message, EPOCH + self._timeline.now):
            self._mouths[topic.name].publish(said)


def rmfs_lift_supervisor(timeline: Timeline, air: Air, *, jazzy: bool = False) -> RmfsSupervisor:
    """Return a stand-in for rmf_lift_supervisor."""
    return RmfsSupervisor(timeline, air, RIVAL, lambda: LiftSupervisor(jazzy), [LIFT_REQUESTS])


def rmfs_door_supervisor(timeline: Timeline, air: Air) -> RmfsSupervisor:
    """Return a stand-in for rmf_door_supervisor."""
    says: list[Topic[Any]] = [DOOR_REQUESTS, DOOR_SUPERVISOR_HEARTBEAT]
    return RmfsSupervisor(timeline, air, "rmf_door_supervisor", DoorSupervisor, says)


class GraphDaemon:
    """The daemon of a supervisor or coordinator, a kind without hardware. Its wall clock is `wall_skew`
    seconds ahead. On a busy machine it takes the messages of `lag_s` in one round."""

    def __init__(
        self,
        timeline: Timeline,
        air: Air,
        name: str,
        kind: AnyGraphKind,
        wall_skew: float = 0.0,
        settings: Any = None,
        lag_s: float = 0.0,
    ) -> None:
        self.name = name
        self.kind = kind
        self._lag_s = lag_s
        self._settings = settings or kind.settings()
        self.alive = False
        self.writer: NoWriter = NOBODY
        self._timeline = timeline
        self._air = air
        self._disk = Disk()
        self._clock = Clock(lambda: timeline.now, lambda: EPOCH + timeline.now + wall_skew)
        self._alarm = Alarm(timeline, self._round)
        self._place: Place
        self.node: AnyGraphNode

    def start(self) -> None:
        """Start a new daemon, which remembers only what is on its disk."""
        self._place = Place(self._air, self.name, self._heard)
        kept = self._disk if self.kind.persist else None
        self.node = GraphNode(
            self.kind, self._settings, self._place, self._clock, kept=kept, writer=self.writer
        )
        self.alive = True
        self.node.subscribe()
        self._round()

    def kill(self) -> None:
        """Kill the daemon."""
        self.alive = False
        self._alarm.set(NEVER)
        self._place.close()

    def reset(self) -> None:
        """Reset the daemon as `rmf-bridge reset` does."""
        self.node.obey(OperatorReset())
        self._round()

    def says(self, topic: Topic[Any], message: Message) -> None:
        """Publish this message, in addition to the node's own messages."""
        self._place.publisher(topic).publish(message)

    def summary(self) -> Mapping[str, Status]:
        """Return each subject's status, as the daemon writes it to its status file."""
        return self.node.devices()

    def _heard(self) -> None:
        if self._lag_s:
            self._alarm.ring_by(self._timeline.now + self._lag_s)
        else:
            self._round()

    def _round(self) -> None:
        if self.alive:
            self.node.round()
            self._alarm.set(max(self.node.wake_at, self._timeline.now + LEAST_GAP_S))
