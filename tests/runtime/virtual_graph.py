"""RMF's graph in virtual time: its participants (parties), the network between them, and our
supervisors.

The network may lose, delay, repeat and reorder each message. Our supervisors and coordinators, the
kinds without hardware, run on the product's own runtime (`GraphNode`). No thread runs: `World.run`
calls each round at its due time.
"""

import heapq
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import GraphKind
from bridges.messages.definitions import Message
from bridges.messages.releases import NEWEST
from bridges.messages.topics import Topic
from bridges.runtime.clock import Clock
from bridges.runtime.graph_node import GraphNode
from bridges.transports.transport import Publisher, Subscription
from workbench.rmf_model import Party as RmfParty
from workbench.rmf_model import Said

EPOCH = 2.0**30
"""The wall time (s) at 0 s on the world's clock. It is a power of two, so that floating-point sums of
times stay exact."""
NEVER = float("inf")

Route = Callable[[str, str], Sequence[float]]
"""A function that gets the sender and the receiver of a message. It returns one delay (s) for each copy
of the message that arrives."""


class Party(Protocol):
    """A participant, such as a node, a robot or a fleet adapter."""

    name: str

    def hear(self, topic: Topic[Any], message: Any) -> None:
        """Receive a message."""

    def wake_at(self) -> float:
        """Return the time (s) of the next call of `wake`."""

    def wake(self) -> None:
        """Act. The world calls this method at the time from `wake_at`."""


def at_once(sender: str, receiver: str) -> Sequence[float]:
    """Return one short delay. Messages arrive in order and without loss."""
    return (0.01,)


def in_order(sender: str, receiver: str) -> Sequence[float]:
    """Return one delay of 0 s. Messages arrive in order and without loss."""
    return (0.0,)


class World:
    """All parties and the messages between them.

    - `sent` has every message as (time in s, sender, topic, message).
    - `watch` gets each message before the message goes out.
    - `publishers` has, for each topic, the parties with a publisher.
    - `hears_others` has (topic, party) for each party that does not hear its own messages on the topic.
    """

    def __init__(self, route: Route = at_once) -> None:
        self.now = 0.0
        self.route = route
        self.parties: dict[str, Party] = {}
        self.hearers: dict[str, set[str]] = defaultdict(set)
        self.publishers: dict[str, set[str]] = defaultdict(set)
        self.hears_others: set[tuple[str, str]] = set()
        self.retained: dict[str, deque[Said]] = {}
        self.sent: list[tuple[float, str, Topic[Any], Any]] = []
        self.watch: Callable[[str, Topic[Any], Any], None] = lambda sender, topic, message: None
        self._post: list[tuple[float, int, str, Topic[Any], Message]] = []
        self._numbers = 0

    def add(self, party: Party, *topics: Topic[Any]) -> None:
        """Let a party join and hear these topics. The new party replaces an earlier party with the same
        name."""
        self.parties[party.name] = party
        for topic in topics:
            self.hearers[topic.name].add(party.name)

    def remove(self, name: str) -> None:
        """Remove a party, its subscriptions and its publishers."""
        del self.parties[name]
        for names in (*self.hearers.values(), *self.publishers.values()):
            names.discard(name)

    def send(self, sender: str, topic: Topic[Any], message: Message) -> None:
        """Publish a message."""
        self.watch(sender, topic, message)
        self.sent.append((round(self.now, 3), sender, topic, message))
        if topic.subscribe.durability == "transient_local":
            retained = self.retained.setdefault(sender, deque(maxlen=topic.publish.depth))
            retained.append((topic, message))
        for receiver in sorted(self.hearers[topic.name]):
            if receiver == sender and (topic.name, sender) in self.hears_others:
                continue
            for delay in self.route(sender, receiver):
                self._arrives_after(delay, receiver, topic, message)

    def replay(self, receiver: str) -> None:
        """Deliver all retained messages to the receiver, as if it had just subscribed."""
        for sender in sorted(self.retained):
            for topic, message in self.retained[sender]:
                if receiver in self.hearers[topic.name]:
                    self._arrives_after(0.05, receiver, topic, message)

    def run(self, until: float, done: Callable[[], bool] = lambda: False) -> None:
        """Run all events until this time (s), or until `done` returns True."""
        wakes = {name: party.wake_at() for name, party in self.parties.items()}
        while not done():
            at = min(wakes.values(), default=NEVER)
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
            # During its `wake` a party may restart, add or remove other parties.
            wakes = {name: party.wake_at() for name, party in self.parties.items()}
        else:
            return
        self.now = until

    def said_on(self, topic: Topic[Any]) -> list[tuple[float, str, Any]]:
        """Return every message on this topic as (time in s, sender, message)."""
        return [(at, who, message) for at, who, on, message in self.sent if on == topic]

    def _arrives_after(
        self, delay: float, receiver: str, topic: Topic[Any], message: Message
    ) -> None:
        self._numbers += 1
        heapq.heappush(self._post, (self.now + delay, self._numbers, receiver, topic, message))


class WorldTransport:
    """The transport of a node in the world (`bridges.transports.transport.Transport`)."""

    speaks = "memory"
    domain_id = 0
    release = NEWEST

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
        if others_only:
            self.world.hears_others.add((topic.name, self.name))
        self.received[topic.name].append(received)
        self.world.hearers[topic.name].add(self.name)
        return _End(self, topic)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        """Receive a message."""
        for received in self.received[topic.name]:
            received(message)

    lives = True

    def sender(self) -> None:
        """Return None, because no daemon in the world asks who sent a message."""

    def faults(self) -> list[tuple[str, str]]:
        return []

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
        assert self._node.name in self._node.world.publishers[self._topic.name], "no publisher"
        self._node.world.send(self._node.name, self._topic, message)

    def matched(self) -> int:
        """Return how many other nodes publish on the topic."""
        return len(self.senders())

    def senders(self) -> list[str]:
        """Return the names of the other nodes that publish on the topic."""
        others = self._node.world.publishers[self._topic.name] - {self._node.name}
        return sorted(f"/{name}" for name in others)

    def close(self) -> None:
        self._node.world.publishers[self._topic.name].discard(self._node.name)


@dataclass
class Disk:
    """The state directory. It outlives the daemon.

    `written` counts the writes. With `full` a write fails.
    """

    kept: bytes | None = None
    written: int = 0
    full: bool = False

    def read(self) -> bytes | None:
        return self.kept

    def write(self, kept: bytes) -> None:
        if self.full:
            raise OSError("no space left on device")
        self.kept, self.written = kept, self.written + 1


class Served:
    """A supervisor or coordinator, a kind without hardware. It runs with the same node as in its real
    daemon."""

    def __init__(
        self,
        world: World,
        kind: GraphKind[Any, Any, Any, Any, Any],
        settings: Any,
        name: str,
        wall_skew: float = 0.0,
        disk: Disk | None = None,
    ) -> None:
        self.name = name
        self.world = world
        self.disk = disk
        self._kind, self._settings = kind, settings
        self._clock = Clock(lambda: world.now, lambda: EPOCH + world.now + wall_skew)
        self.transport = WorldTransport(world, name)
        self.restart()

    def restart(self) -> None:
        """Start a new daemon. It reads the memory on its disk, and hears all retained messages."""
        self.transport.close()
        self.world.add(self)
        self.transport = WorldTransport(self.world, self.name)
        self.node = GraphNode(
            self._kind, self._settings, self.transport, self._clock, kept=self.disk
        )
        self.node.subscribe()
        self.world.replay(self.name)
        self.node.round()

    def leave(self) -> None:
        """Stop, and leave the graph."""
        self.world.remove(self.name)

    def reset(self) -> None:
        """Reset the node as an operator does. Latched faults may then clear."""
        self.node.obey(OperatorReset())
        self.node.round()

    def hear(self, topic: Topic[Any], message: Any) -> None:
        self.transport.hear(topic, message)
        self.node.round()

    def wake_at(self) -> float:
        return self.node.wake_at

    def wake(self) -> None:
        self.node.round()

    @property
    def subjects(self) -> list[str]:
        """Return the names of the lifts or doors that the node knows."""
        return list(self.node.devices())

    def faults(self) -> dict[str, list[str]]:
        """Return the faults in the status, for each lift or door that has a fault."""
        shown = {name: status["faults"] for name, status in self.node.devices().items()}
        return {
            name: [f"{fault['code']}: {fault['detail']}" for fault in faults]
            for name, faults in shown.items()
            if faults
        }


class Ticking:
    """A node with subscriptions and a timer. The timer calls `tick` every `every_s` seconds."""

    def __init__(self, world: World, name: str, every_s: float, tick: Callable[[], None]) -> None:
        self.name = name
        self.transport = WorldTransport(world, name)
        self._every_s, self._tick = every_s, tick
        self._next_at = world.now + every_s
        world.add(self)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        self.transport.hear(topic, message)

    def wake_at(self) -> float:
        return self._next_at

    def wake(self) -> None:
        self._next_at += self._every_s
        self._tick()


class StandIn:
    """A stand-in for one of RMF's parties. The function `new` makes the party, which follows RMF's
    rules."""

    def __init__(
        self, world: World, new: Callable[[], RmfParty], name: str, publishes: Topic[Any]
    ) -> None:
        self.name = name
        self.world = world
        self._new = new
        self._publishes = publishes
        self.restart()

    def restart(self) -> None:
        """Replace the party on the graph by a new one. The new party has no memory, and receives all
        retained messages again."""
        self.party = self._new()
        self.world.add(self, *self.party.subscribes)
        self.world.publishers[self._publishes.name].add(self.name)
        self.world.replay(self.name)

    def leave(self) -> None:
        """Stop, and leave the graph."""
        self.world.remove(self.name)

    def hear(self, topic: Topic[Any], message: Any) -> None:
        say(self.world, self.name, self.party.hear(message, EPOCH + self.world.now))

    def wake_at(self) -> float:
        return self.party.wake_at() - EPOCH

    def wake(self) -> None:
        say(self.world, self.name, self.party.tick(EPOCH + self.world.now))


def say(world: World, who: str, said: Iterable[Said]) -> None:
    """Publish messages in the name of one of RMF's parties."""
    for topic, message in said:
        world.send(who, topic, message)
