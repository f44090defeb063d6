"""The `memory` transport between nodes of one process, for tests in virtual time.

The transport has no thread. The only clock that it reads is the wall clock. `publish` delivers a
message before `publish` returns. The oldest subscription gets the message first.

Publisher and subscription match as in DDS, if name and type are equal. A subscription that wants
retained messages hears only publishers that retain messages.
"""

import time
from collections import defaultdict, deque
from collections.abc import Callable

from bridges.messages import cdr
from bridges.messages.definitions import Message
from bridges.messages.heard import Sender
from bridges.messages.releases import NEWEST, Release
from bridges.messages.topics import AnyTopic, Topic
from bridges.transports import notices
from bridges.transports.transport import M, Receive, TransportError, any_type


class MemoryNetwork:
    """The network of one test: the publishers and subscriptions of all nodes, by topic."""

    def __init__(self) -> None:
        self.publishers: dict[str, list[_Publisher]] = defaultdict(list)
        self.subscriptions: dict[str, list[_Subscription]] = defaultdict(list)


class MemoryTransport:
    """One node on a MemoryNetwork. Callbacks run on the publishing thread."""

    speaks = "memory"
    domain_id = 0

    def __init__(self, network: MemoryNetwork, node_name: str, release: Release = NEWEST) -> None:
        self.name = node_name
        self.dropped: dict[str, int] = {}
        self.release = release
        self.heard_from: Sender | None = None
        self._network = network
        self._closed = False

    def publisher(self, topic: AnyTopic) -> "_Publisher":
        """Declare a publisher with `topic.publish` QoS."""
        self._require_open()
        publisher = _Publisher(self, self._network, topic)
        self._network.publishers[topic.name].append(publisher)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> "_Subscription":
        """Declare a subscription with `topic.subscribe` QoS. Retained messages arrive at once."""
        self._require_open()
        subscription = _Subscription(self, self._network, topic, any_type(received), others_only)
        self._network.subscriptions[topic.name].append(subscription)
        subscription.catch_up()
        return subscription

    def sender(self) -> Sender | None:
        """Return the publisher of the message that a callback is reading now."""
        return self.heard_from

    @property
    def lives(self) -> bool:
        """Return whether this node is still open."""
        return not self._closed

    def faults(self) -> list[tuple[str, str]]:
        """Return no fault, because all nodes belong to one process and one release."""
        return []

    def wall(self) -> float:
        """Return the wall clock (s since the epoch)."""
        return time.time()

    def close(self) -> None:
        """Leave the network. The messages that this node retained are lost."""
        self._closed = True
        for ends in self._network.publishers.values():
            ends[:] = [end for end in ends if end.node is not self]
        for hears in self._network.subscriptions.values():
            hears[:] = [end for end in hears if end.node is not self]

    def _require_open(self) -> None:
        if self._closed:
            raise TransportError(f"{self.name} has left the graph")


class _Publisher:
    def __init__(self, node: MemoryTransport, network: MemoryNetwork, topic: AnyTopic) -> None:
        self.node = node
        self.topic = topic
        self.sender = Sender(f"/{node.name}")
        self.retained: deque[Message] = deque(maxlen=topic.publish.depth)
        self._ends = network.publishers[topic.name]
        self._heard_by = network.subscriptions[topic.name]

    def publish(self, message: Message) -> None:
        """Deliver a message at once. Raise CdrError for a message that no wire could carry."""
        if self not in self._ends:
            raise TransportError(f"topic {self.topic.name}: the node has left the graph")
        cdr.encode(self.topic.type, message, self.node.release)
        if self.topic.publish.durability == "transient_local":
            self.retained.append(message)
        for subscription in list(self._heard_by):
            if subscription.hears(self):
                subscription.hand_on(message, self.sender)

    def matched(self) -> int:
        """Return the number of matched subscriptions, or 0 after close."""
        return sum(end.hears(self) for end in self._heard_by) if self in self._ends else 0

    def close(self) -> None:
        """Remove this publisher from the graph."""
        if self in self._ends:
            self._ends.remove(self)


class _Subscription:
    def __init__(
        self,
        node: MemoryTransport,
        network: MemoryNetwork,
        topic: AnyTopic,
        received: Receive,
        others_only: bool,
    ) -> None:
        self.node = node
        self.received = received
        self._ends = network.subscriptions[topic.name]
        self._hears = network.publishers[topic.name]
        self.topic = topic
        self._others_only = others_only

    def hears(self, publisher: _Publisher) -> bool:
        """Return whether DDS would match this publisher with this subscription. The caller has already
        checked that their topic names are equal."""
        theirs, ours = publisher.topic, self.topic
        return (
            theirs.type == ours.type
            and (ours.subscribe.durability, theirs.publish.durability)
            != ("transient_local", "volatile")
            and not (self._others_only and publisher.node is self.node)
        )

    def hand_on(self, message: Message, sender: Sender) -> None:
        """Deliver a message. The subscriber's exceptions do not reach the publisher, as on a wire."""
        self.node.heard_from = sender
        notices.hand_on(self.node.dropped, self.topic, self.received, message)

    def catch_up(self) -> None:
        """Deliver the newest `depth` retained messages of each publisher to this subscription."""
        if self.topic.subscribe.durability == "volatile":
            return
        for publisher in self._hears:
            if self.hears(publisher):
                for message in list(publisher.retained)[-self.topic.subscribe.depth :]:
                    self.hand_on(message, publisher.sender)

    def matched(self) -> int:
        """Return the number of matched publishers, or 0 after close."""
        return len(self.senders())

    def senders(self) -> list[str]:
        """Return the names of the nodes with matched publishers."""
        heard = self._hears if self in self._ends else []
        return [f"/{end.node.name}" for end in heard if self.hears(end)]
