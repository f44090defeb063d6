"""The `ros2` transport: an ordinary ROS 2 node, by rclpy, on whichever RMW is installed.

Samples are taken and published as bytes, and `cdr.py` reads and writes them: a message means the same
as on `dds`, a sample that is no message is dropped and counted as there, and rclpy converts nothing.
rclpy's executor runs in one thread of ours, and what it calls only hands the message on.

Source: rclpy 7.1 (ROS 2 Jazzy); its public API, with RCLError and InvalidHandle as RuntimeErrors.
rclpy is imported here alone, the message packages in ros_types.py, and both only by choose.py.
"""

import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final, Generic, TypeVar

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
from bridges.rmf import cdr, notices, topics
from bridges.rmf.definitions import Message
from bridges.rmf.loopback import LOOPBACK
from bridges.rmf.ros_types import ros_type
from bridges.rmf.topics import Topic
from bridges.rmf.transport import TransportError

log = logging.getLogger(__name__)

M = TypeVar("M", bound=Message)

ON_LOOPBACK: Final = {
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    "ROS_LOCALHOST_ONLY": None,
    "ROS_STATIC_PEERS": None,
    "CYCLONEDDS_URI": LOOPBACK,
}
"""What an RMW reads when it joins: it finds nobody but this machine's nodes. Cyclone, told so in
its own words as well, does not even leave the loopback interface."""
UNHEARD: Final = 256
"""Own messages that may be on their way back to us: more than twice any topic's depth."""

AGAIN_S: Final = 1.0
"""After a failure of rclpy's own, its executor is asked again."""
YIELD_S: Final = 50e-6
"""After a callback rclpy's executor keeps Python's lock for a while. This pause lets the thread that
the message has woken run first."""


class Ros2Transport:
    """One rclpy node, its context and its executor's thread.

    `ros_args`: what stood behind `--ros-args` on the command line: name, namespace, remappings and
    parameters (`use_sim_time`). `loopback`: stay on this machine whatever the environment says.
    Raises TransportError when the graph cannot be joined.
    """

    speaks = "ros2"

    def __init__(
        self,
        node_name: str,
        domain_id: int,
        *,
        loopback: bool,
        ros_args: Sequence[str] = (),
    ) -> None:
        self.name = node_name
        self.dropped: dict[str, int] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._pause = threading.Event()
        self._publishers: list[_Publisher[Any]] = []
        self._deaf: list[_Subscription[Any]] = []
        self._context = Context()
        try:
            with _environment(ON_LOOPBACK if loopback else {}):
                self._join(domain_id, ros_args)
        except (RuntimeError, NameValidationException) as error:
            self._context.try_shutdown()
            raise TransportError(f"cannot join ROS domain {domain_id}: {error}") from error
        self._thread = threading.Thread(target=self._spin, name=f"{self.name}-ros2", daemon=True)
        self._thread.start()

    def publisher(self, topic: Topic[M]) -> "_Publisher[M]":
        """Declare a publisher with `topic.publish` QoS. Raises TransportError, as for a ROS package
        that is not installed."""
        with self._lock, self._reporting(f"topic {topic.name} cannot be published"):
            publisher = _Publisher(self, topic)
            self._publishers.append(publisher)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> "_Subscription[M]":
        """Declare a subscription with `topic.subscribe` QoS; `received` runs on our thread."""
        with self._lock, self._reporting(f"topic {topic.name} cannot be subscribed"):
            subscription = _Subscription(self, topic, received, others_only=others_only)
            if others_only:
                self._deaf.append(subscription)
        return subscription

    def wall(self) -> float:
        """ROS's time (s since the epoch): the wall clock, or `/clock` where use_sim_time is set."""
        return float(self.node.get_clock().now().nanoseconds * 1e-9)

    def close(self) -> None:
        """Leave the graph at once, so that no ghost endpoint remains. May be called twice."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._pause.set()
        self._leaving.trigger()
        if threading.current_thread() is not self._thread:
            self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    @property
    def lives(self) -> bool:
        """Is it on the graph, and is its thread running?"""
        return not self._closed and self._thread.is_alive()

    def heard_back(self, topic: Topic[Any]) -> "list[_Subscription[Any]]":
        """The subscriptions of this node that must not hear what it publishes on the topic."""
        return [end for end in self._deaf if end.would_hear(topic)]

    def own_publishers(self, subscription: "_Subscription[Any]") -> int:
        """How many of our own publishers a subscription must not hear."""
        return sum(subscription.would_hear(end.topic) for end in self._publishers)

    def withdraw(self, publisher: "_Publisher[Any]") -> None:
        """Take one publisher off the graph; after close there is none left to take."""
        with self._lock:
            if not self._closed and publisher in self._publishers:
                self._publishers.remove(publisher)
                self.node.destroy_publisher(publisher.end)

    def _join(self, domain_id: int, ros_args: Sequence[str]) -> None:
        # Logging is ours: rclpy's would open a file below $HOME, which a service has not.
        self._context.init(args=list(ros_args), initialize_logging=False, domain_id=domain_id)
        self.node: Any = Node(
            self.name,
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,  # nobody turns the clock of a running daemon
        )
        self.name = self.node.get_name()
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._leaving = self.node.create_guard_condition(lambda: None)

    def _spin(self) -> None:
        """Run the executor. An exception of rclpy ends the thread only if it keeps coming, or if the
        context is gone."""
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

    @contextmanager
    def _reporting(self, text: str) -> Iterator[None]:
        if self._closed:
            raise TransportError(f"{text}: {self.name} has left the graph")
        try:
            yield
        except (RuntimeError, NameValidationException) as error:
            raise TransportError(f"{text}: {error}") from error


class _Publisher(Generic[M]):
    def __init__(self, transport: Ros2Transport, topic: Topic[M]) -> None:
        self.topic = topic
        self._transport = transport
        self.end = transport.node.create_publisher(
            ros_type(topic.type),
            topic.name,
            _profile(topic.publish),
            event_callbacks=PublisherEventCallbacks(
                incompatible_qos=_misfit(topic, notices.NOT_SERVED)
            ),
        )

    def publish(self, message: M) -> None:
        """Send. Raises TransportError when it was not sent, CdrError for what no sample can hold."""
        if not self._transport.lives:
            raise TransportError(f"topic {self.topic.name}: closed, or the reader has died")
        sample = cdr.encode(self.topic.type, message)
        for subscription in self._transport.heard_back(self.topic):
            subscription.said.append(cdr.decode(self.topic.type, sample))
        try:
            self.end.publish(sample)
        except RuntimeError as error:
            raise TransportError(f"topic {self.topic.name}: not sent: {error}") from error

    def matched(self) -> int:
        """How many subscriptions are reached, without our own that must not hear us; 0 after close."""
        try:
            count = int(self.end.get_subscription_count())
        except RuntimeError:
            return 0
        return max(0, count - len(self._transport.heard_back(self.topic)))

    def close(self) -> None:
        """Take this end off the graph."""
        self._transport.withdraw(self)


class _Subscription(Generic[M]):
    """`said`: what this node has published here and not heard back yet, if it wants others only.

    rclpy (Jazzy) cannot ask for that, and does not tell whose a sample is.
    """

    def __init__(
        self,
        transport: Ros2Transport,
        topic: Topic[M],
        received: Callable[[M], None],
        *,
        others_only: bool,
    ) -> None:
        self.topic = topic
        self.said: deque[M] = deque(maxlen=UNHEARD)
        self._transport = transport
        self._received = received
        self._others_only = others_only
        self._end = transport.node.create_subscription(
            ros_type(topic.type),
            topic.name,
            self._take,
            _profile(topic.subscribe),
            raw=True,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=_misfit(topic, notices.NOT_HEARD)
            ),
        )

    def would_hear(self, published: Topic[Any]) -> bool:
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
            message = cdr.decode(self.topic.type, sample)
        except cdr.CdrError as error:
            notices.drop(self._transport.dropped, self.topic, error)
            return
        if message in self.said:
            self.said.remove(message)
            return
        notices.hand_on(self._transport.dropped, self.topic, self._received, message)
        time.sleep(YIELD_S)


def _profile(qos: topics.Qos) -> Any:
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


def _misfit(topic: Topic[Any], text: str) -> Callable[[Any], None]:
    def tell(event: Any) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind).lower()
        notices.misfit(topic, text, policy)

    return tell


@contextmanager
def _environment(wanted: Mapping[str, str | None]) -> Iterator[None]:
    """These variables for a while; None: without it."""
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
