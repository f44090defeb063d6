"""The ends of the `ros2` transport. An end is a publisher or a subscription.

The transport may leave the ROS graph and join it again, for example when the network changes. The end
remains, but its rclpy object is replaced by a new one. rclpy's callbacks run in the transport's thread,
and only deliver the message.
"""

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Final, Protocol

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher as RosPublisher
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.subscription import Subscription as RosSubscription

from bridges.messages import cdr, topics
from bridges.messages.definitions import Message
from bridges.messages.releases import Release
from bridges.messages.topics import AnyTopic
from bridges.transports import notices
from bridges.transports.repeats import Repeats
from bridges.transports.ros2.types import ros_type
from bridges.transports.transport import Receive, TransportError

UNHEARD: Final = 256
"""The maximum number of our own messages that we have sent, but that have not yet come back to our own
subscription. It is more than twice the depth of any topic."""
YIELD_S: Final = 50e-6
"""The pause (s) after a callback. The callback wakes another thread, which needs Python's global lock
to handle the message. The pause releases this lock. Without the pause, rclpy's executor would keep
it for a while."""


class Ends:
    """The ends of one node. An `others_only` subscription must not receive messages of the node's own
    publishers."""

    def __init__(self, release: Release) -> None:
        self.release = release
        self.publishers: tuple[Ros2Publisher, ...] = ()
        self.subscriptions: tuple[Ros2Subscription, ...] = ()

    def __iter__(self) -> "Iterator[Ros2Publisher | Ros2Subscription]":
        """Yield the subscriptions first. When the node joins again, a publisher repeats its retained
        messages, and each subscription that must ignore them must already know them as our own."""
        yield from self.subscriptions
        yield from self.publishers

    def heard_back(self, topic: AnyTopic) -> "list[Ros2Subscription]":
        """Return this node's subscriptions that must ignore our own messages on the topic, although DDS
        delivers these messages to them."""
        return [end for end in self.subscriptions if end.others_only and end.would_hear(topic)]

    def unheard_publishers(self, subscription: "Ros2Subscription") -> int:
        """Return the number of this node's own publishers that the subscription must not hear."""
        if not subscription.others_only:
            return 0
        return sum(subscription.would_hear(end.topic) for end in self.publishers)


class Ros2Publisher:
    """The publisher of one topic. `lives()` returns whether the transport runs. `withdraw(publisher)`
    takes the publisher off the graph."""

    def __init__(
        self,
        topic: AnyTopic,
        ends: Ends,
        lives: Callable[[], bool],
        withdraw: "Callable[[Ros2Publisher], None]",
    ) -> None:
        self.topic = topic
        self._ends = ends
        self._lives = lives
        self._withdraw = withdraw
        self._using = threading.Lock()
        self._end: RosPublisher | None = None
        self._retained: deque[bytes] = deque(maxlen=topic.repeats)

    def create(self, node: Node) -> None:
        """Make rclpy's publisher. Send the retained messages that still hold again, for late joiners.
        Raises TransportError, and RuntimeError of rclpy."""
        made = node.create_publisher(
            ros_type(self.topic.type, self._ends.release),
            self.topic.name,
            _profile(self.topic.publish),
            event_callbacks=PublisherEventCallbacks(
                incompatible_qos=_misfit(self.topic, notices.NOT_SERVED)
            ),
        )
        with self._using:
            self._end = made
            for sample in self._retained:
                self._write(sample)

    def drop(self) -> None:
        """Forget rclpy's publisher. Its node has already been removed."""
        with self._using:
            self._end = None

    def destroy(self, node: Node) -> None:
        """Take rclpy's publisher off the graph."""
        with self._using:
            if self._end is not None:
                node.destroy_publisher(self._end)
            self._end = None

    def publish(self, message: Message) -> None:
        """Send a message. Raises TransportError if the message was not sent, and CdrError if it cannot
        be encoded."""
        if not self._lives():
            raise TransportError(f"topic {self.topic.name}: closed, or the reader has died")
        sample = cdr.encode(self.topic.type, message, self._ends.release)
        with self._using:  # so that `create` sends no older message after this one
            self._retained.append(sample)
            self._write(sample)

    def matched(self) -> int:
        """Return the number of subscriptions that receive this publisher's messages. Do not count this
        node's own `others_only` subscriptions. Return 0 after `close`."""
        with self._using:
            try:
                count = int(self._end.get_subscription_count()) if self._end else 0
            except RuntimeError:
                return 0
        return max(0, count - len(self._ends.heard_back(self.topic)))

    def close(self) -> None:
        """Remove this publisher from the ROS graph."""
        self._withdraw(self)

    def _write(self, sample: bytes) -> None:
        """Send a message's bytes. The caller holds the lock `_using`. Raises TransportError."""
        if self._end is None:
            raise TransportError(f"topic {self.topic.name}: not sent: there is no network")
        for subscription in self._ends.heard_back(self.topic):
            subscription.said.append(cdr.decode(self.topic.type, sample, self._ends.release))
        try:
            self._end.publish(sample)
        except RuntimeError as error:
            raise TransportError(f"topic {self.topic.name}: not sent: {error}") from error


class Ros2Subscription:
    """The subscription of one topic. `dropped`: the number of invalid samples, by the topic's name.

    `said`: the messages that this node has published itself, and that DDS has not yet delivered to this
    subscription. An `others_only` subscription skips such a message when it arrives. rclpy (Jazzy) has
    no option for this, and does not name the sender of a sample.
    """

    def __init__(
        self,
        topic: AnyTopic,
        received: Receive,
        ends: Ends,
        dropped: dict[str, int],
        *,
        others_only: bool,
    ) -> None:
        self.topic = topic
        self.others_only = others_only
        self.said: deque[Message] = deque(maxlen=UNHEARD)
        self._received = received
        self._ends = ends
        self._dropped = dropped
        self._repeats = Repeats(topic)
        self._using = threading.Lock()
        self._end: RosSubscription | None = None
        self._node: Node | None = None

    def create(self, node: Node) -> None:
        """Make rclpy's subscription."""
        self.said.clear()
        made = node.create_subscription(
            ros_type(self.topic.type, self._ends.release),
            self.topic.name,
            self._take,
            _profile(self.topic.subscribe),
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=_misfit(self.topic, notices.NOT_HEARD)
            ),
        )
        with self._using:
            self._end, self._node = made, node

    def drop(self) -> None:
        """Forget rclpy's subscription. Its node has already been removed."""
        with self._using:
            self._end = self._node = None

    def would_hear(self, published: AnyTopic) -> bool:
        """Return whether DDS would match this subscription with a publisher of the topic
        `published`."""
        durabilities = (self.topic.subscribe.durability, published.publish.durability)
        return (published.name, published.type) == (self.topic.name, self.topic.type) and (
            durabilities != ("transient_local", "volatile")
        )

    def matched(self) -> int:
        """Return the number of publishers that this subscription hears. Return 0 after `close`."""
        with self._using:
            try:
                count = int(self._end.get_publisher_count()) if self._end else 0
            except RuntimeError:
                return 0
        return max(0, count - self._ends.unheard_publishers(self))

    def senders(self) -> list[str]:
        """Return the nodes of the publishers that this subscription hears."""
        with self._using:
            node = self._node
            try:
                found = node.get_publishers_info_by_topic(self.topic.name) if node else []
            except RuntimeError:
                return []
            ours = (node.get_namespace(), node.get_name()) if node and self.others_only else ()
        names = [(end.node_namespace, end.node_name) for end in found]
        return [f"{space.rstrip('/')}/{name}" for space, name in names if (space, name) != ours]

    def _take(self, sample: bytes, info: Mapping[str, int]) -> None:
        """Deliver a sample. `info`: rclpy's MessageInfo, which a callback with two parameters gets."""
        try:
            message = cdr.decode(self.topic.type, sample, self._ends.release)
        except cdr.CdrError as error:
            notices.drop(self._dropped, self.topic, error)
            return
        if message in self.said:
            self.said.remove(message)
            return
        if not self._repeats.has(info["source_timestamp"], message):
            notices.hand_on(self._dropped, self.topic, self._received, message)
        time.sleep(YIELD_S)


def _profile(qos: topics.Qos) -> QoSProfile:
    durability = {
        "volatile": DurabilityPolicy.VOLATILE,
        "transient_local": DurabilityPolicy.TRANSIENT_LOCAL,
    }
    return QoSProfile(
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability[qos.durability],
        history=HistoryPolicy.KEEP_LAST,
        depth=qos.depth,
    )


class _Misfit(Protocol):
    """rclpy's event about a peer whose QoS does not match an end."""

    last_policy_kind: object


def _misfit(topic: AnyTopic, text: str) -> Callable[[_Misfit], None]:
    def tell(event: _Misfit) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        notices.misfit(topic, text, policy)

    return tell
