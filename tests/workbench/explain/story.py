"""Short scenes in virtual time, with the simulated devices of `tests/site`.

The daemons' decision code and the drivers are real. A model of RMF follows RMF's rules. Every message
on the graph becomes a `Heard`, as in a recording.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from random import Random
from typing import Any

from bridges.kinds.charger_coordinator import KIND as COORDINATOR
from bridges.kinds.door_supervisor import KIND as DOOR_SUPERVISOR
from bridges.kinds.lift_supervisor import KIND as LIFT_SUPERVISOR
from bridges.kinds.shared.graph_kind import AnyGraphKind
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.heard import Heard
from bridges.messages.stamps import stamp
from bridges.messages.topics import Topic
from bridges.runtime import diagnostics
from tests.site import charging
from tests.site.building import CHARGERS, devices
from tests.site.daemons import (
    DeviceDaemon,
    GraphDaemon,
    RmfsSupervisor,
    rmfs_door_supervisor,
    rmfs_lift_supervisor,
)
from tests.site.network import CLEAR, Air, Place
from tests.site.timeline import EPOCH, Alarm, Timeline
from workbench.rmf_model.phases import DoorClose, DoorOpen, EndLiftSession, RequestLift
from workbench.rmf_model.robot import Phase, RobotContext

SUPERVISORS: dict[str, AnyGraphKind] = {
    "lift_supervisor": LIFT_SUPERVISOR,
    "door_supervisor": DOOR_SUPERVISOR,
}


class Rider(ABC):
    """A robot and the phases of its task. `robot` has all that the fleet adapter knows of the robot."""

    robot: RobotContext

    @abstractmethod
    def begin(self, phase: Phase) -> None:
        """Begin this phase of the robot's task."""

    def asks(self, lift: str, floor: str, *, inside: bool = False) -> None:
        """Begin RequestLift."""
        self.begin(RequestLift(lift, floor, inside=inside))

    def ends(self, lift: str) -> None:
        """Begin EndLiftSession."""
        self.begin(EndLiftSession(lift))

    def opens(self, door: str) -> None:
        """Begin DoorOpen."""
        self.begin(DoorOpen(door))

    def closes(self, door: str) -> None:
        """Begin DoorClose."""
        self.begin(DoorClose(door))


class Guest(Rider):
    """A fleet adapter with one robot on the simulated graph. The adapter's clock is `behind_s` seconds
    slow."""

    def __init__(self, timeline: Timeline, air: Air, name: str) -> None:
        self.robot = RobotContext(name)
        self.behind_s = 0.0
        self.place = Place(air, name, lambda: None)
        self._timeline = timeline
        self._alarm = Alarm(timeline, self._tick)
        self._mouths = {
            topic.name: self.place.publisher(topic)
            for topic in (topics.ADAPTER_LIFT_REQUESTS, topics.ADAPTER_DOOR_REQUESTS)
        }
        for topic in self.robot.subscribes:
            self.place.subscribe(topic, self._hear)

    def begin(self, phase: Phase) -> None:
        self._say(self.robot.begin(phase, self._now))

    def dies(self) -> None:
        """Remove the robot's adapter from the graph. The adapter sends no last message."""
        self.place.close()
        self.robot.phase = None

    @property
    def _now(self) -> float:
        return EPOCH + self._timeline.now - self.behind_s

    def _hear(self, message: Any) -> None:
        self._say(self.robot.hear(message, self._now))

    def _tick(self) -> None:
        self._say(self.robot.tick(self._now))

    def _say(self, said: Sequence[tuple[Topic[Any], d.Message]]) -> None:
        for topic, message in said:
            self._mouths[topic.name].publish(message)
        self._alarm.set(self.robot.wake_at() - EPOCH + self.behind_s)


class Scene:
    """A site on a simulated graph.

    A daemon runs for each device in `serves`. With `rmf`, RMF's own supervisors replace ours.
    """

    def __init__(self, *serves: str, rmf: bool = False, diagnoses: bool = True) -> None:
        self.timeline = Timeline()
        self.air = Air(self.timeline, Random(7))
        self.air.weather = CLEAR
        self.air.watch = self._watch
        self.heard: list[Heard] = []
        self.devices = devices(self.timeline)
        self.daemons = {
            name: DeviceDaemon(self.timeline, self.air, self.devices[name]) for name in serves
        }
        self.supervisors: dict[str, GraphDaemon | RmfsSupervisor] = {}
        self._diagnoses = diagnoses
        for daemon in self.daemons.values():
            daemon.start()
        self._supervise(rmf)
        self._second()
        self.run(4.0)  # for some seconds after its start, a supervisor only listens
        self.heard.clear()
        self.run(2.0)

    def robot(self, name: str) -> Guest:
        """Return a new robot with this name (FLEET/ROBOT)."""
        return Guest(self.timeline, self.air, name)

    def run(self, seconds: float) -> None:
        """Let this many seconds pass."""
        self.timeline.run(self.timeline.now + seconds)

    def until(self, guest: Rider, within_s: float = 90.0) -> None:
        """Let time pass until the robot's phase is done."""
        end = self.timeline.now + within_s
        while not guest.robot.done:
            assert self.timeline.now < end, f"not within {within_s} s"
            self.run(0.25)

    def rides(self, guest: Rider, lift: str, start: str, end: str) -> None:
        """Let the robot ride from `start` to `end`."""
        guest.asks(lift, start)
        self.until(guest)
        self.run(5.0)
        guest.asks(lift, end, inside=True)
        self.until(guest)
        self.run(5.0)
        guest.ends(lift)
        self.until(guest)

    def press(self, device: str, signal: str, on: bool) -> None:
        """Switch a signal of the device, as a person or the building would."""
        daemon = self.daemons[device]
        daemon.advance()
        self.devices[device].plant.press(signal, on, self.timeline.now)
        daemon.look()

    def fail(self, device: str, part: str, mode: Any) -> None:
        """Let a wire or another part of the device fail."""
        daemon = self.daemons[device]
        daemon.advance()
        self.devices[device].plant.fail(part, mode)
        daemon.look()

    def says(self, topic: Topic[Any], message: d.Message) -> None:
        """Publish a message from another node."""
        Place(self.air, "somebody", lambda: None).publisher(topic).publish(message)

    def coordinate(self, *robots: str) -> None:
        """Start a charger coordinator for these robots."""
        settings = charging.settings(CHARGERS, robots)
        name = "coordinator"
        self.supervisors[name] = node = GraphDaemon(
            self.timeline, self.air, name, COORDINATOR, settings=settings
        )
        node.start()

    def _supervise(self, rmf: bool) -> None:
        if rmf:
            for made in (rmfs_lift_supervisor, rmfs_door_supervisor):
                theirs = made(self.timeline, self.air)
                self.supervisors[theirs.name] = theirs
        else:
            for name, kind in SUPERVISORS.items():
                self.supervisors[name] = GraphDaemon(self.timeline, self.air, name, kind)
        for supervisor in self.supervisors.values():
            supervisor.start()

    def _watch(self, speaker: str, topic: Topic[Any], message: d.Message) -> None:
        now = self.timeline.now
        self.heard.append(Heard(now, EPOCH + now, topic.name, message))

    def _second(self) -> None:
        """Publish each daemon's diagnostics once a second, as `bridges/runtime/daemon.py` does."""
        if self._diagnoses:
            for name, daemon in self.daemons.items():
                if daemon.alive:
                    self._diagnose(
                        f"rmf_bridge_{name}", daemon.device.kind.name, {name: daemon.status()}
                    )
            for name, node in self.supervisors.items():
                if isinstance(node, GraphDaemon) and node.alive:
                    self._diagnose(name, node.kind.name, node.summary())
        self.timeline.after(1.0, self._second)

    def _diagnose(self, node: str, kind: str, devices: Any) -> None:
        at = stamp(EPOCH + self.timeline.now)
        array = diagnostics.diagnosis(node, kind, {}, devices, at)
        self._watch(node, topics.DIAGNOSTICS, array)
