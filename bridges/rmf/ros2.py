"""The `ros2` transport: an ordinary ROS 2 node, by rclpy, on whichever RMW is installed.

Samples pass through rclpy as bytes, and `cdr.py` encodes and decodes them, as on `dds`. An invalid
sample is dropped and counted, as there. rclpy's executor runs in a thread of this transport; its
callbacks only deliver the message.

Source: rclpy 7.1 (ROS 2 Jazzy), its public API; RCLError and InvalidHandle are RuntimeErrors. Only
this file imports rclpy, only ros_types.py the message packages, and only choose.py imports this one.
"""

import atexit
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final, Protocol

from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)

from bridges.log import pairs
from bridges.rmf import cdr, notices, ros_peers, topics
from bridges.rmf.cyclone import LOOPBACK
from bridges.rmf.definitions import Message
from bridges.rmf.ros_types import installed, ros_type
from bridges.rmf.threaded import Threaded
from bridges.rmf.topics import AnyTopic, Topic
from bridges.rmf.transport import M, Receive, TransportError, any_type

log = logging.getLogger(__name__)

ON_LOOPBACK: Final = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "ROS_LOCALHOST_ONLY": None,
    "ROS_STATIC_PEERS": None,
    "CYCLONEDDS_URI": LOOPBACK,
}
"""The variables that an RMW reads when it joins. With these it only finds this machine's nodes, and
Cyclone stays on the loopback interface."""
UNHEARD: Final = 256
"""The most own messages that may be on their way back to us: over twice any topic's depth."""

AGAIN_S: Final = 1.0
"""How long (s) to wait after an exception of rclpy before its executor runs again."""
YIELD_S: Final = 50e-6
"""rclpy's executor holds Python's lock for a while after a callback. This pause (s) lets the thread
that the message has woken run first."""


class Ros2Transport(Threaded):
    """One rclpy node, its context and its executor's thread.

    `ros_args`: the arguments after `--ros-args` on the command line: name, namespace, remappings and
    parameters (`use_sim_time`). `loopback`: stay on this machine, whatever the environment says.
    Raises TransportError when the graph cannot be joined.
    """

    speaks = "ros2"

    refusals = (RuntimeError, NameValidationException)

    def __init__(
        self,
        node_name: str,
        domain_id: int,
        *,
        loopback: bool,
        ros_args: Sequence[str] = (),
    ) -> None:
        super().__init__(node_name, domain_id, installed())
        self._pause = threading.Event()
        self._publishers: list[_Publisher] = []
        self._deaf: list[_Subscription] = []
        self._subscribed: list[AnyTopic] = []
        self._context = Context()
        try:
            with _environment(ON_LOOPBACK if loopback else {}):
                self._join(domain_id, ros_args)
        except (RuntimeError, NameValidationException) as error:
            self._context.try_shutdown()
            raise TransportError(f"cannot join ROS domain {domain_id}: {error}") from error
        self._start(self._spin, "ros2")
        # An executor's thread that outlives the interpreter aborts it, as where a start is refused.
        atexit.register(self.close)

    def publisher(self, topic: AnyTopic) -> "_Publisher":
        """Declare a publisher with `topic.publish` QoS. Raises TransportError, also for a missing ROS
        package."""
        with self._lock, self._reporting(f"topic {topic.name} cannot be published"):
            publisher = _Publisher(self, topic)
            self._publishers.append(publisher)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> "_Subscription":
        """Declare a subscription with `topic.subscribe` QoS; `received` runs on our thread."""
        with self._lock, self._reporting(f"topic {topic.name} cannot be subscribed"):
            subscription = _Subscription(self, topic, any_type(received), others_only=others_only)
            self._subscribed.append(topic)
            if others_only:
                self._deaf.append(subscription)
        return subscription

    def faults(self) -> list[tuple[str, str]]:
        """What keeps it apart from others; from any thread."""
        if not self.lives:
            return []
        published = [(end.topic, True) for end in list(self._publishers)]
        subscribed = [(topic, False) for topic in list(self._subscribed)]
        ros_peers.look(self.node, self._peers, [*published, *subscribed])
        return self._peers.faults()

    def wall(self) -> float:
        """ROS's time (s since the epoch): the wall clock, or `/clock` where use_sim_time is set."""
        return float(self.node.get_clock().now().nanoseconds * 1e-9)

    def close(self) -> None:
        """Leave the graph at once, so that no ghost endpoint remains. May be called twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        atexit.unregister(self.close)
        self._pause.set()
        self._leaving.trigger()
        self._join_thread()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def heard_back(self, topic: AnyTopic) -> "list[_Subscription]":
        """The subscriptions of this node that must not hear what it publishes on the topic."""
        return [end for end in self._deaf if end.would_hear(topic)]

    def own_publishers(self, subscription: "_Subscription") -> int:
        """How many of this node's own publishers a subscription must not hear."""
        return sum(subscription.would_hear(end.topic) for end in self._publishers)

    def withdraw(self, publisher: "_Publisher") -> None:
        """Take one publisher off the graph; after close that has happened already."""
        with self._lock:
            if not self._closed and publisher in self._publishers:
                self._publishers.remove(publisher)
                self.node.destroy_publisher(publisher.end)

    def _join(self, domain_id: int, ros_args: Sequence[str]) -> None:
        # Without rclpy's logging: it would open a file below $HOME, and a service has none.
        self._context.init(args=list(ros_args), initialize_logging=False, domain_id=domain_id)
        self.node = Node(
            self.name,
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,  # nobody changes the clock of a running daemon
        )
        self.name = self.node.get_name()
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._leaving = self.node.create_guard_condition(lambda: None)

    def _spin(self) -> None:
        """Run the executor. An exception of rclpy ends the thread only if it keeps coming, or if the
        context has been shut down."""
        failures = 0
        while not self._closed and self._context.ok() and failures < notices.FAILURES:
            try:
                self._executor.spin_once()
                failures = 0
            except Exception as error:
                failures += 1
                if failures == 1:
                    log.exception(pairs("reader_failed", node=self.name, reason=error))
                self._pause.wait(AGAIN_S)


class _Publisher:
    def __init__(self, transport: Ros2Transport, topic: AnyTopic) -> None:
        self.topic = topic
        self._transport = transport
        self.end = transport.node.create_publisher(
            ros_type(topic.type, transport.release),
            topic.name,
            _profile(topic.publish),
            event_callbacks=PublisherEventCallbacks(
                incompatible_qos=_misfit(topic, notices.NOT_SERVED)
            ),
        )

    def publish(self, message: Message) -> None:
        """Send. Raises TransportError if it was not sent, CdrError if no sample can hold it."""
        if not self._transport.lives:
            raise TransportError(f"topic {self.topic.name}: closed, or the reader has died")
        release = self._transport.release
        sample = cdr.encode(self.topic.type, message, release)
        for subscription in self._transport.heard_back(self.topic):
            subscription.said.append(cdr.decode(self.topic.type, sample, release))
        try:
            self.end.publish(sample)
        except RuntimeError as error:
            raise TransportError(f"topic {self.topic.name}: not sent: {error}") from error

    def matched(self) -> int:
        """How many subscriptions are reached, without own ones that it must skip; 0 after close."""
        try:
            count = int(self.end.get_subscription_count())
        except RuntimeError:
            return 0
        return max(0, count - len(self._transport.heard_back(self.topic)))

    def close(self) -> None:
        """Take this end off the graph."""
        self._transport.withdraw(self)


class _Subscription:
    """`said`: with `others_only`, what this node has published here and not heard back yet.

    rclpy (Jazzy) has no such option, and does not say who sent a sample.
    """

    def __init__(
        self,
        transport: Ros2Transport,
        topic: AnyTopic,
        received: Receive,
        *,
        others_only: bool,
    ) -> None:
        self.topic = topic
        self.said: deque[Message] = deque(maxlen=UNHEARD)
        self._transport = transport
        self._received = received
        self._others_only = others_only
        self._end = transport.node.create_subscription(
            ros_type(topic.type, transport.release),
            topic.name,
            self._take,
            _profile(topic.subscribe),
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=_misfit(topic, notices.NOT_HEARD)
            ),
        )

    def would_hear(self, published: AnyTopic) -> bool:
        """Whether DDS would match this end with a publisher of that topic."""
        durabilities = (self.topic.subscribe.durability, published.publish.durability)
        return (published.name, published.type) == (self.topic.name, self.topic.type) and (
            durabilities != ("transient_local", "volatile")
        )

    def matched(self) -> int:
        """How many publishers are heard; 0 after close."""
        try:
            count = int(self._end.get_publisher_count())
        except RuntimeError:
            return 0
        ours = self._transport.own_publishers(self) if self._others_only else 0
        return max(0, count - ours)

    def _take(self, sample: bytes) -> None:
        try:
            message = cdr.decode(self.topic.type, sample, self._transport.release)
        except cdr.CdrError as error:
            notices.drop(self._transport.dropped, self.topic, error)
            return
        if message in self.said:
            self.said.remove(message)
            return
        notices.hand_on(self._transport.dropped, self.topic, self._received, message)
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
    """rclpy's event for a peer whose QoS does not fit an end."""

    last_policy_kind: object


def _misfit(topic: AnyTopic, text: str) -> Callable[[_Misfit], None]:
    def tell(event: _Misfit) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        notices.misfit(topic, text, policy)

    return tell


@contextmanager
def _environment(wanted: Mapping[str, str | None]) -> Iterator[None]:
    """Set these variables for the length of the block; None removes one."""
    before = {name: os.environ.get(name) for name in wanted}
    _set(wanted)
    try:
        yield
    finally:
        _set(before)


def _set(wanted: Mapping[str, str | None]) -> None:
    for name, value in wanted.items():
        os.environ.pop(name, None)
        if value is not None:
            os.environ[name] = value
