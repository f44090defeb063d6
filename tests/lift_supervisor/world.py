"""A building in virtual time: fleet adapters, a lift supervisor, a lift node with its lift, a network.

The supervisor is ours as it is served (GraphNode), or the stand-in for RMF's. The lift node is ours as
it is served (Node), on a lift that works. The fleet adapters are RMF's rules. Nothing has a thread.
"""

import heapq
from collections import defaultdict, deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from bridges.lift import KIND as LIFT
from bridges.lift.settings import LiftSettings
from bridges.lift_supervisor import KIND as SUPERVISOR
from bridges.lift_supervisor.settings import Settings
from bridges.rmf.definitions import LiftRequest, LiftState, Message
from bridges.rmf.topics import ADAPTER_LIFT_REQUESTS, LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.rmf.transport import Publisher, Subscription
from bridges.serve.clock import Clock
from bridges.serve.device import Node
from bridges.serve.graph import GraphNode
from hal_fakes.rmf import Party as RmfParty
from hal_fakes.rmf.phases import EndLiftSession, RequestLift
from hal_fakes.rmf.robot import Phase, Robot
from hal_fakes.rmf.supervisors import LiftSupervisor
from tests.lift.story import Controller
from tests.lift_supervisor.alone import words

EPOCH = 1_800_000_000.0
NEVER = float("inf")
FLOORS = ["L1", "L2", "L3"]

Route = Callable[[str, str], Sequence[float]]
"""How long a message takes from one party to another (s), for each copy that arrives."""


class Party(Protocol):
    """Somebody in the building."""

    name: str

    def hear(self, topic: Topic[Any], message: Any) -> None:
        """A message has arrived."""

    def wake_at(self) -> float:
        """When `wake` is due."""

    def wake(self) -> None:
        """It is."""


def at_once(sender: str, receiver: str) -> Sequence[float]:
    """A network without loss or delay worth mentioning, in order."""
    return (0.01,)


class World:
    """`log`: (s, who, words) of each request sent on, and each change of session that is shown."""

    def __init__(self, route: Route = at_once) -> None:
        self.now = 0.0
        self.route = route
        self.parties: dict[str, Party] = {}
        self.hearers: dict[str, set[str]] = defaultdict(set)
        self.publishers: dict[str, set[str]] = defaultdict(set)
        self.retained: dict[str, deque[Message]] = {}
        self.sent: list[tuple[float, str, str, Message]] = []
        self._post: list[tuple[float, int, str, Topic[Any], Message]] = []
        self._numbers = 0

    def add(self, party: Party, *topics: Topic[Any]) -> None:
        """Let it take part, in the place of one of the same name; it hears these topics."""
        self.parties[party.name] = party
        for topic in topics:
            self.hearers[topic.name].add(party.name)

    def remove(self, name: str) -> None:
        """Somebody leaves for good."""
        del self.parties[name]
        for hearers in self.hearers.values():
            hearers.discard(name)

    def send(self, sender: str, topic: Topic[Any], message: Message) -> None:
        """Publish."""
        self.sent.append((round(self.now, 3), sender, topic.name, message))
        if topic == ADAPTER_LIFT_REQUESTS:
            self.retained.setdefault(sender, deque(maxlen=100)).append(message)
        for receiver in sorted(self.hearers[topic.name]):
            for delay in self.route(sender, receiver):
                self.post(delay, receiver, topic, message)

    def post(self, delay: float, receiver: str, topic: Topic[Any], message: Message) -> None:
        """Let it arrive after so long (s)."""
        self._numbers += 1
        heapq.heappush(self._post, (self.now + delay, self._numbers, receiver, topic, message))

    def replay(self, receiver: str) -> None:
        """What every adapter has retained, as it comes to one who subscribes now."""
        for sender in sorted(self.retained):
            for message in self.retained[sender]:
                self.post(0.05, receiver, ADAPTER_LIFT_REQUESTS, message)

    def run(self, until: float, done: Callable[[], bool] = lambda: False) -> None:
        """Everything that happens until then, or until it is done."""
        wakes = {name: party.wake_at() for name, party in self.parties.items()}
        while not done():
            at = min(wakes.values())
            if self._post and self._post[0][0] <= at:
                at, _, receiver, topic, message = self._post[0]
                if at > until:
                    break
                heapq.heappop(self._post)
                self.now = max(self.now, at)
                if receiver in self.parties:
                    self.parties[receiver].hear(topic, message)
                    wakes[receiver] = self.parties[receiver].wake_at()
                continue
            if at > until:
                break
            self.now = max(self.now, at)
            next(party for name, party in self.parties.items() if wakes[name] == at).wake()
            # Who wakes may be the hand that restarts, adds or removes others.
            wakes = {name: party.wake_at() for name, party in self.parties.items()}
        else:
            return
        self.now = until

    def requests(self) -> list[tuple[float, str]]:
        """What was sent to the lift's node: (s, words)."""
        return [
            (at, words(message))
            for at, _, topic, message in self.sent
            if topic == LIFT_REQUESTS.name and isinstance(message, LiftRequest)
        ]

    def sessions(self) -> list[tuple[float, str]]:
        """Whom the lift has shown: (s, session), each time that it differs."""
        shown: list[tuple[float, str]] = []
        for at, _, _, message in self.sent:
            if isinstance(message, LiftState) and message.session_id != (shown or [(0, "")])[-1][1]:
                shown.append((at, message.session_id))
        return shown


class LiftNode:
    """Our lift node, scanning a lift that works."""

    SCAN_S = 0.25

    def __init__(self, world: World, name: str = "Lift1") -> None:
        self.name = name
        self.world = world
        self.lift = Controller(FLOORS)
        self.settings = LiftSettings(floors=FLOORS)
        world.add(self, LIFT_REQUESTS)
        self.restart()

    def restart(self) -> None:
        """A new daemon: outputs off, nothing remembered."""
        clock = Clock(lambda: self.world.now, lambda: EPOCH + self.world.now)
        limits = LIFT.limits(self.settings, {})
        self.lift.advance(self.world.now)
        self.lift.make_safe()
        self.node = Node(self.name, LIFT, self.settings, limits, self.lift, self._say, clock)
        self._scan_at = self.world.now
        self.wake()

    def _say(self, topic: Topic[Any], message: Message) -> None:
        self.world.send(self.name, topic, message)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        if message.lift_name == self.name:
            event = self.node.event(topic, message)
            self._scan(*([] if event is None else [event]))

    def wake_at(self) -> float:
        return self._scan_at

    def wake(self) -> None:
        self._scan()

    def _scan(self, *events: Any) -> None:
        self.lift.advance(self.world.now)
        self.node.scan(events)
        next_at = min(self.node.wake_at, self.world.now + self.SCAN_S)
        self._scan_at = max(next_at, self.world.now + 0.001)


class WorldTransport:
    """A node's place in the world."""

    def __init__(self, world: World, name: str) -> None:
        self.name = name
        self.dropped: dict[str, int] = {}
        self.world = world
        self.received: dict[str, list[Callable[[Any], None]]] = defaultdict(list)

    def publisher(self, topic: Topic[Any]) -> Publisher[Any]:
        self.world.publishers[topic.name].add(self.name)
        return _End(self, topic)

    def subscribe(
        self, topic: Topic[Any], received: Callable[[Any], None], *, others_only: bool = False
    ) -> Subscription:
        if not others_only:
            self.received[topic.name].append(received)
        return _End(self, topic)

    def wall(self) -> float:
        return EPOCH + self.world.now

    def close(self) -> None:
        for ends in self.world.publishers.values():
            ends.discard(self.name)


class _End:
    def __init__(self, node: WorldTransport, topic: Topic[Any]) -> None:
        self._node = node
        self._topic = topic

    def publish(self, message: Any) -> None:
        self._node.world.send(self._node.name, self._topic, message)

    def matched(self) -> int:
        """Others' publishers."""
        return len(self._node.world.publishers[self._topic.name] - {self._node.name})

    def close(self) -> None:
        self._node.world.publishers[self._topic.name].discard(self._node.name)


class OurSupervisor:
    """Our supervisor, as the daemon serves it."""

    def __init__(
        self,
        world: World,
        settings: Settings | None = None,
        name: str = "supervisor",
        wall_skew: float = 0.0,
    ) -> None:
        self.name = name
        self.world = world
        self.settings = settings or Settings()
        self._clock = Clock(lambda: world.now, lambda: EPOCH + world.now + wall_skew)
        self.transport = WorldTransport(world, name)
        world.add(self, ADAPTER_LIFT_REQUESTS, LIFT_STATES)
        self.restart()

    def restart(self) -> None:
        """A new daemon: nothing remembered, and everything retained heard again."""
        self.transport.close()
        self.transport = WorldTransport(self.world, self.name)
        self.node = GraphNode(SUPERVISOR, self.settings, self.transport, self._clock)
        self.node.subscribe()
        self.world.replay(self.name)
        self.node.round()

    def leave(self) -> None:
        """It is stopped for good."""
        self.transport.close()
        self.world.remove(self.name)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        for received in self.transport.received[topic.name]:
            received(message)
        self.node.round()

    def wake_at(self) -> float:
        return self.node.wake_at

    def wake(self) -> None:
        self.node.round()


class RmfsSupervisor:
    """The stand-in for RMF's own."""

    def __init__(self, world: World, name: str = "rmf_supervisor") -> None:
        self.name = name
        self.world = world
        world.add(self, ADAPTER_LIFT_REQUESTS, LIFT_STATES)
        world.publishers[LIFT_REQUESTS.name].add(name)
        self.restart()

    def restart(self) -> None:
        self.party: RmfParty = LiftSupervisor()
        self.world.replay(self.name)

    def leave(self) -> None:
        """It is stopped for good."""
        self.world.publishers[LIFT_REQUESTS.name].discard(self.name)
        self.world.remove(self.name)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        for to, said in self.party.hear(message, EPOCH + self.world.now):
            self.world.send(self.name, to, said)

    def wake_at(self) -> float:
        return NEVER

    def wake(self) -> None:
        """It has no timer."""


class Rider:
    """A robot with its fleet adapter: it rides each of its trips, then is done.

    `skew`: its clock is ahead of ours (s). `rode`: (s, trip) of each ride that has ended.
    """

    ENTER_S = 3.0
    REST_S = 3.0

    def __init__(
        self,
        world: World,
        name: str,
        *trips: tuple[str, str],
        starts_at: float = 5.0,
        skew: float = 0.0,
    ) -> None:
        self.name = name
        self.world = world
        self.skew = skew
        self.trips = list(trips)
        self.rode: list[tuple[float, tuple[str, str]]] = []
        self.robot = Robot(name)
        self._step = 0
        self._next_at = starts_at
        world.add(self, LIFT_STATES)

    @property
    def done(self) -> bool:
        return not self.trips

    def restart(self) -> None:
        """A new fleet adapter, which sends its robot on the same trip once more, from the start."""
        self.world.retained.pop(self.name, None)
        self.robot = Robot(self.name)
        self._step = 0
        self._next_at = NEVER if self.done else self.world.now + 2.0

    def die(self) -> None:
        """It says nothing any more."""
        self.world.retained.pop(self.name, None)
        self.world.hearers[LIFT_STATES.name].discard(self.name)
        self._next_at = NEVER

    def hear(self, topic: Topic[Any], message: Any) -> None:
        running = not self.robot.done
        for to, said in self.robot.hear(message, EPOCH + self.world.now + self.skew):
            self.world.send(self.name, to, said)
        if running and self.robot.done:
            self._step += 1
            self._next_at = self.world.now + self.ENTER_S

    def wake_at(self) -> float:
        return self._next_at

    def wake(self) -> None:
        self._next_at = NEVER
        if self._step == 3:
            self.rode.append((round(self.world.now, 3), self.trips.pop(0)))
            self._step = 0
            self._next_at = NEVER if self.done else self.world.now + self.REST_S
            return
        self.robot.in_car = self._step == 1
        for to, said in self.robot.begin(self._phase(), EPOCH + self.world.now + self.skew):
            self.world.send(self.name, to, said)

    def _phase(self) -> Phase:
        pickup, target = self.trips[0]
        return [
            RequestLift("Lift1", pickup, inside=False),
            RequestLift("Lift1", target, inside=True),
            EndLiftSession("Lift1"),
        ][self._step]
