"""The judge in virtual time on a simulated ROS graph, with the judged nodes and models of RMF's
nodes."""

from collections.abc import Callable, Iterable
from functools import partial
from random import Random

from bridges.messages import topics
from bridges.messages.definitions import Message
from bridges.messages.heard import Heard
from bridges.messages.topics import AnyTopic
from bridges.transports.transport import Publisher
from tests.site.network import CLEAR, Air, Place
from tests.site.timeline import EPOCH, NEVER, Alarm, Timeline
from workbench.judge.charge_scenario import ChargeScenario
from workbench.judge.judge import Judge, JudgedKind
from workbench.judge.judge_run import JudgeRun
from workbench.judge.law import Verdict
from workbench.judge.scenarios import PassageScenario, RideScenario, Scenario
from workbench.rmf_model import Party, Said

HEARD: tuple[AnyTopic, ...] = (
    *(topics.LIFT_STATES, topics.LIFT_REQUESTS, topics.ADAPTER_LIFT_REQUESTS),
    *(topics.DOOR_STATES, topics.DOOR_REQUESTS, topics.ADAPTER_DOOR_REQUESTS),
    *(topics.DOOR_SUPERVISOR_HEARTBEAT, topics.FIRE_ALARM_TRIGGER.live()),
    *(topics.CHARGER_STATES, topics.CHARGER_REQUESTS, topics.CHARGER_CANCELS),
    *(topics.CHARGER_REFUSALS, topics.FLEET_STATES),
)
STATES: dict[JudgedKind, AnyTopic] = {
    "lift": topics.LIFT_STATES,
    "door": topics.DOOR_STATES,
    "charger": topics.CHARGER_STATES,
    "adapter": topics.ADAPTER_LIFT_REQUESTS,
}
Verdicts = dict[str, set[str]]


class Seat:
    """A simulated node's connection to the graph. The node's clock is `skew_s` seconds ahead of the
    wall clock."""

    def __init__(self, world: "World", party: Party, skew_s: float = 0.0) -> None:
        self.party = party
        self.skew_s = skew_s
        self._world = world
        self._place = Place(world.air, type(party).__name__, lambda: None)
        self._alarm = Alarm(world.timeline, self._wake)
        self._publishers: dict[AnyTopic, Publisher[Message]] = {}
        for topic in party.subscribes:
            self._place.subscribe(topic, self._hear)
        self._wake()

    @property
    def _now(self) -> float:
        return EPOCH + self._world.timeline.now + self.skew_s

    def leave(self) -> None:
        """Remove the node from the graph, as when its process dies."""
        self._alarm.set(NEVER)
        self._place.close()

    def say(self, said: Iterable[Said]) -> None:
        for topic, message in said:
            if topic not in self._publishers:
                self._publishers[topic] = self._place.publisher(topic)
            self._publishers[topic].publish(message)

    def _hear(self, message: Message) -> None:
        self.say(self.party.hear(message, self._now))
        self._set()

    def _wake(self) -> None:
        self.say(self.party.tick(self._now))
        self._set()

    def _set(self) -> None:
        self._alarm.set(max(self.party.wake_at() - EPOCH - self.skew_s, self._world.timeline.now))


class World:
    """A simulated ROS graph on which no message gets lost, and all nodes on the graph."""

    def __init__(self, random: Random | None = None) -> None:
        self.timeline = Timeline()
        self.air = Air(self.timeline, random or Random(1))
        self.air.weather = CLEAR

    def add(self, *parties: Party) -> list[Seat]:
        return [Seat(self, party) for party in parties]

    def judge(
        self,
        kind: JudgedKind,
        name: str,
        scenario: Scenario | None = None,
        for_s: float = NEVER,
        most_s: float = 600.0,
        also: Callable[[JudgeRun], None] = lambda judging: None,
    ) -> JudgeRun:
        """Let the judge listen for `for_s` seconds, or play the scenario. In both cases, stop the judge
        after `most_s` seconds."""
        judging = JudgeRun(Judge(kind, name), scenario, for_s)
        place = Place(self.air, "judge", lambda: None)
        publishers: dict[AnyTopic, Publisher[Message]] = {}

        def say(said: list[Said]) -> None:
            for topic, message in said:
                if topic not in publishers:
                    publishers[topic] = place.publisher(topic)
                publishers[topic].publish(message)
            alarm.set(max(judging.wake_at(), self.timeline.now + 0.001))

        def hear(topic: AnyTopic, message: Message) -> None:
            if not judging.done:
                now = self.timeline.now
                say(judging.hear(Heard(now, EPOCH + now, topic.name, message, place.sender())))

        def turn() -> None:
            if not judging.done:
                say(judging.turn(self.timeline.now, EPOCH + self.timeline.now))

        alarm = Alarm(self.timeline, turn)
        judging.begin(self.timeline.now, EPOCH + self.timeline.now)
        for topic in HEARD:
            place.subscribe(topic, partial(hear, topic), others_only=True)
        ends = [
            place.subscribe(topic, lambda message: None)
            for topic in (topics.FIRE_ALARM_TRIGGER.live(), topics.FIRE_ALARM_TRIGGER)
        ]
        states = place.subscribe(STATES[kind], lambda message: None)
        say([])
        also(judging)
        until = self.timeline.now + most_s
        while not judging.done and self.timeline.now < until:
            self.timeline.run(self.timeline.now + 0.5)
            publishing, retaining = (end.senders() for end in ends)
            now = self.timeline.now
            judging.judge.history.senders = tuple(states.senders())
            judging.judge.alarm_ends(publishing, retaining, now, EPOCH + now)
        alarm.set(NEVER)
        place.close()
        return judging


def told(judging: JudgeRun, now: float) -> Verdicts:
    """Return the ids of the laws for each verdict."""
    found: Verdicts = {verdict.value: set() for verdict in Verdict}
    for judged in judging.judge.end(now, EPOCH + now, now - judging.began_at):
        found[judged.verdict.value].add(judged.law.id)
    return found


def rides(
    *nodes: Party, robots: int = 1, restarts: bool = False, name: str = "Lift1"
) -> tuple[Verdicts, str]:
    """Return the verdict on a lift that robots ride from L1 to L3, and the judge's note."""
    world = World()
    world.add(*nodes)
    ride = RideScenario(name, ("L1", "L3"), robots, 60.0, restarts=restarts)
    judging = world.judge("lift", name, ride)
    return told(judging, world.timeline.now), judging.note


def passes(*nodes: Party, times: int = 3, restarts: bool = False) -> tuple[Verdicts, str]:
    """Return the verdict on a door that a robot passes, and the judge's note."""
    world = World()
    world.add(*nodes)
    judging = world.judge("door", "ward", PassageScenario("ward", times, 60.0, restarts=restarts))
    return told(judging, world.timeline.now), judging.note


def charges(*nodes: Party) -> tuple[Verdicts, str]:
    """Return the verdict on a charger that the judge requests, and the judge's note."""
    world = World()
    world.add(*nodes)
    judging = world.judge("charger", "bay1", ChargeScenario("bay1", "fleet/red", "r1", 20.0))
    return told(judging, world.timeline.now), judging.note


def watched(kind: JudgedKind, name: str, *parties: Party, for_s: float = 60.0) -> Verdicts:
    """Return the verdict on a device after the judge has only listened."""
    world = World()
    world.add(*parties)
    judging = world.judge(kind, name, for_s=for_s, most_s=for_s + 1.0)
    return told(judging, world.timeline.now)
