"""A fleet adapter's node and its robots, which follow RMF's rules."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final

from bridges.messages import topics
from bridges.messages.topics import Topic
from bridges.transports.transport import Transport
from tests.site.timeline import Alarm, Timeline
from tests.workbench.explain.story import Rider
from workbench.rmf_model import Party
from workbench.rmf_model.fleet import FleetAdapter
from workbench.rmf_model.robot import Phase, RobotContext

FLEET: Final = "fleet"
ROBOTS: Final = ("red", "blue", "green")
DRIVE_S: Final = 20.0
SAYS: Final[tuple[Topic[Any], ...]] = (
    topics.ADAPTER_LIFT_REQUESTS,
    topics.ADAPTER_DOOR_REQUESTS,
    topics.FLEET_STATES,
)


Join = Callable[[str], Transport]
"""A function that joins the graph. The argument is the node's name."""


class PartyNode:
    """A stand-in for one of RMF's nodes. The stand-in follows RMF's rules. `wall` returns the node's
    clock (s since the epoch)."""

    def __init__(
        self,
        timeline: Timeline,
        join: Join,
        wall: Callable[[], float],
        name: str,
        party: Party,
        says: Iterable[Topic[Any]],
    ) -> None:
        self.name = name
        self.wall = wall
        self._parties = [party]
        self._timeline = timeline
        self._alarm = Alarm(timeline, self._tick)
        self._place = join(name)
        self._mouths = {topic.name: self._place.publisher(topic) for topic in says}

    def start(self) -> None:
        """Subscribe to all topics that the node's parties, such as robots, need."""
        heard = {topic for party in self._parties for topic in party.subscribes}
        for topic in sorted(heard, key=lambda topic: topic.name):
            self._place.subscribe(topic, self._hear)
        self._tick()

    def kill(self) -> None:
        """Leave the graph, as when the process is killed."""
        self._place.close()
        self._parties.clear()

    def say(self, said: Any) -> None:
        """Publish messages of the parties, and set the alarm for the next tick."""
        for topic, message in said:
            self._mouths[topic.name].publish(message)
        left_s = min(party.wake_at() for party in self._parties) - self.wall()
        self._alarm.set(self._timeline.now + max(left_s, 0.001))

    def _hear(self, message: Any) -> None:
        for party in [*self._parties]:
            self.say(party.hear(message, self.wall()))

    def _tick(self) -> None:
        for party in [*self._parties]:
            if party.wake_at() <= self.wall() + 1e-6:
                self.say(party.tick(self.wall() + 1e-6))


class Fleet(PartyNode):
    """One adapter for all robots of a fleet. The adapter's clock is `behind_s` seconds slow."""

    def __init__(
        self,
        timeline: Timeline,
        join: Join,
        wall: Callable[[], float],
        places: Mapping[str, tuple[str, float, float]],
    ) -> None:
        parked = {robot: f"wait_{robot}" for robot in ROBOTS}
        self.behind_s = 0.0
        self.robots = FleetAdapter(FLEET, places, parked, DRIVE_S)
        super().__init__(
            timeline,
            join,
            lambda: wall() - self.behind_s,
            f"{FLEET}_fleet_adapter",
            self.robots,
            SAYS,
        )

    def add(self, robot: RobotContext) -> None:
        """Let the adapter publish requests for this robot from now on."""
        self._parties.append(robot)

    def drop(self, robot: RobotContext) -> None:
        """Let the adapter stop publishing requests for this robot."""
        self._parties.remove(robot)


class Robot(Rider):
    """One robot of the fleet."""

    def __init__(self, fleet: Fleet, name: str) -> None:
        self.robot = RobotContext(f"{FLEET}/{name}")
        self._fleet = fleet
        fleet.add(self.robot)

    def begin(self, phase: Phase) -> None:
        self._fleet.say(self.robot.begin(phase, self._fleet.wall()))

    def asks(self, lift: str, floor: str, *, inside: bool = False) -> None:
        self.robot.in_car = inside
        super().asks(lift, floor, inside=inside)

    def ends(self, lift: str) -> None:
        self.robot.in_car = False
        super().ends(lift)

    def is_dropped(self) -> None:
        """Let the adapter stop publishing requests for this robot."""
        self._fleet.drop(self.robot)
