"""A fleet adapter's node with its robots, by RMF's rules."""

from collections.abc import Mapping
from typing import Any, Final

from bridges.messages import topics
from bridges.messages.topics import Topic
from tests.site.network import Air, Place
from tests.site.timeline import EPOCH, Alarm, Timeline
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


class Fleet:
    """One adapter for all robots of one fleet. `behind_s`: its clock's error."""

    def __init__(
        self, timeline: Timeline, air: Air, places: Mapping[str, tuple[str, float, float]]
    ) -> None:
        parked = {robot: f"wait_{robot}" for robot in ROBOTS}
        self.name = f"{FLEET}_fleet_adapter"
        self.behind_s = 0.0
        self.robots = FleetAdapter(FLEET, places, parked, DRIVE_S)
        self._parties: list[Party] = [self.robots]
        self._timeline = timeline
        self._alarm = Alarm(timeline, self._tick)
        self._place = Place(air, self.name, lambda: None)
        self._mouths = {topic.name: self._place.publisher(topic) for topic in SAYS}
        for topic in (*RobotContext.subscribes, *FleetAdapter.subscribes):
            self._place.subscribe(topic, self._hear)
        self._tick()

    def add(self, robot: RobotContext) -> None:
        """The adapter speaks for this robot from now on."""
        self._parties.append(robot)

    def drop(self, robot: RobotContext) -> None:
        """The adapter speaks for this robot no longer."""
        self._parties.remove(robot)

    def dies(self) -> None:
        """The adapter is killed."""
        self._place.close()
        self._parties.clear()

    @property
    def now(self) -> float:
        """The adapter's own clock (s since the epoch)."""
        return EPOCH + self._timeline.now - self.behind_s

    def say(self, said: Any) -> None:
        """Publish what a party sends, and be called when the next one is due."""
        for topic, message in said:
            self._mouths[topic.name].publish(message)
        due = min(party.wake_at() for party in self._parties) - EPOCH + self.behind_s
        self._alarm.set(max(due, self._timeline.now + 0.001))

    def _hear(self, message: Any) -> None:
        for party in [*self._parties]:
            self.say(party.hear(message, self.now))

    def _tick(self) -> None:
        for party in [*self._parties]:
            if party.wake_at() <= self.now + 1e-6:
                self.say(party.tick(self.now + 1e-6))


class Robot(Rider):
    """One robot of the fleet."""

    def __init__(self, fleet: Fleet, name: str) -> None:
        self.robot = RobotContext(f"{FLEET}/{name}")
        self._fleet = fleet
        fleet.add(self.robot)

    def begin(self, phase: Phase) -> None:
        self._fleet.say(self.robot.begin(phase, self._fleet.now))

    def asks(self, lift: str, floor: str, *, inside: bool = False) -> None:
        self.robot.in_car = inside
        super().asks(lift, floor, inside=inside)

    def ends(self, lift: str) -> None:
        self.robot.in_car = False
        super().ends(lift)

    def is_dropped(self) -> None:
        """Its adapter says nothing for it any more."""
        self._fleet.drop(self.robot)
