"""The `ros2` transport, an ordinary ROS 2 node with rclpy. It works with any installed middleware
(RMW).

As on `dds`, samples pass through the library as bytes, and `cdr.py` encodes and decodes them. Invalid
samples are dropped and counted. A thread of this transport runs rclpy's executor.

When the machine's addresses change or its wall clock is set back, this thread leaves the graph. Then it
joins again with the same publishers and subscriptions. After a step of the clock this is necessary only
with Cyclone. With another RMW it only causes a short interruption.

Source: rclpy 7.1 (ROS 2 Jazzy), its public API. Only this file, `stay.py` and `ends.py` import rclpy.
Only `types.py` imports the message packages, and only `choose.py` imports this file.
"""

import atexit
import logging
from collections.abc import Callable, Sequence
from typing import Final

from rclpy.node import Node

from bridges.messages.topics import AnyTopic, Topic
from bridges.system.log import pairs
from bridges.transports import addresses, notices
from bridges.transports.ros2 import peers as ros_peers
from bridges.transports.ros2.ends import Ends, Ros2Publisher, Ros2Subscription
from bridges.transports.ros2.stay import REFUSALS, Stay
from bridges.transports.ros2.types import installed
from bridges.transports.threaded import LOOK_EVERY_S, Threaded
from bridges.transports.transport import M, TransportError, any_type

log = logging.getLogger(__name__)

AGAIN_S: Final = 1.0
"""The pause (s) between an exception of rclpy and the next run of its executor."""


class Ros2Transport(Threaded):
    """One rclpy node, its ends, and the thread of its executor.

    `ros_args`: the arguments after `--ros-args` on the command line, which are name, namespace,
    remappings and parameters (`use_sim_time`). `loopback`: stay on this machine, even if the
    environment says otherwise. Raises TransportError if the node cannot join the graph.

    The node joins the graph again when the wall clock is set back. Without `loopback` it also joins
    again when the machine's addresses change. Publishers then repeat the retained messages that still
    hold (`Topic.repeats`).
    """

    speaks = "ros2"

    refusals = REFUSALS

    def __init__(
        self,
        node_name: str,
        domain_id: int,
        *,
        loopback: bool,
        ros_args: Sequence[str] = (),
    ) -> None:
        super().__init__(node_name, domain_id, installed())
        self._asked_name = node_name
        self._loopback = loopback
        self._ros_args = ros_args
        self._ends = Ends(self.release)
        self._stay: Stay | None = None
        with self._reporting(f"cannot join ROS domain {domain_id}"):
            self._join()
        self.name = self.node.get_name()
        self._start(self._spin, "ros2")
        self._watch_clock()
        # If the executor's thread still runs when the interpreter exits, the interpreter aborts. This
        # could happen after a failed start.
        atexit.register(self.close)

    @property
    def node(self) -> Node:
        """rclpy's node. The transport gets a new node when it joins again. Raises TransportError
        without a network."""
        if self._stay is None:
            raise TransportError(f"{self.name} has no network")
        return self._stay.node

    def publisher(self, topic: AnyTopic) -> Ros2Publisher:
        """Declare a publisher with `topic.publish` QoS. Raises TransportError, for example if a ROS
        package is missing."""
        publisher = Ros2Publisher(topic, self._ends, lambda: self.lives, self._withdraw)
        with self._lock, self._reporting(f"topic {topic.name} cannot be published"):
            if self._stay is not None:
                publisher.create(self._stay.node)
            self._ends.publishers += (publisher,)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Ros2Subscription:
        """Declare a subscription with `topic.subscribe` QoS. The transport's thread calls
        `received`."""
        subscription = Ros2Subscription(
            topic, any_type(received), self._ends, self.dropped, others_only=others_only
        )
        with self._lock, self._reporting(f"topic {topic.name} cannot be subscribed"):
            if self._stay is not None:
                subscription.create(self._stay.node)
            self._ends.subscriptions += (subscription,)
        return subscription

    def faults(self) -> list[tuple[str, str]]:
        """Return the code and the detail of each fault that keeps nodes from hearing each other. Any
        thread may call this method."""
        with self._lock:
            if not self.lives or self._stay is None:
                return []
            published = [(end.topic, True) for end in self._ends.publishers]
            subscribed = [(end.topic, False) for end in self._ends.subscriptions]
            ros_peers.look(self._stay.node, self._peers, [*published, *subscribed])
            return self._peers.faults()

    def wall(self) -> float:
        """Return ROS's time (s since the epoch). This is the wall clock, or `/clock` with
        use_sim_time."""
        return float(self._clock.now().nanoseconds * 1e-9)

    def close(self) -> None:
        """Leave the graph at once, so that other nodes do not still see a dead endpoint. A second call
        does nothing."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._stop.set()
            self._wake()
        atexit.unregister(self.close)
        self._join_thread()
        self._leave()

    def _wake(self) -> None:
        if self._stay is not None:
            self._stay.leave_soon()

    def _join(self) -> None:
        """Join the ROS graph with a new `Stay`. Raises one of REFUSALS."""
        self._addresses = addresses.addresses()
        self._stay = Stay(
            self._asked_name, self.domain_id, loopback=self._loopback, ros_args=self._ros_args
        )
        self._clock = self._stay.node.get_clock()

    def _leave(self) -> None:
        for end in self._ends:
            end.drop()
        stay, self._stay = self._stay, None
        if stay is not None:
            stay.leave()

    def _join_anew(self) -> None:
        with self._lock:
            if self._closed:
                return
            was_joined, self._set_back = self._stay is not None, False
            self._leave()
            try:
                self._join()
                for end in self._ends:
                    end.create(self.node)
            except (*REFUSALS, TransportError) as error:
                self._leave()
                if was_joined:
                    log.warning(pairs("not_joined", node=self.name, reason=error))

    def _spin(self) -> None:
        """Run the executor. The thread ends after repeated exceptions of rclpy, or after the context
        was shut down."""
        failures = 0
        while not self._closed and self._lasts() and failures < notices.FAILURES:
            try:
                self._spin_once()
                failures = 0
            except Exception as error:
                failures += 1
                if failures == 1:
                    log.exception(pairs("reader_failed", node=self.name, reason=error))
                self._stop.wait(AGAIN_S)

    def _lasts(self) -> bool:
        return self._stay is None or self._stay.lasts

    def _spin_once(self) -> None:
        if self._set_back:
            self._join_anew()
        if (self._stay is None or not self._loopback) and self._look_is_due():
            self._follow_network()
        if self._stay is None:
            self._stop.wait(LOOK_EVERY_S)
        else:
            self._stay.spin(None if self._loopback else LOOK_EVERY_S)

    def _follow_network(self) -> None:
        """Join again if the machine's addresses have changed, or if the last attempt failed."""
        if self._network_changed() or self._stay is None:
            self._join_anew()

    def _withdraw(self, publisher: Ros2Publisher) -> None:
        """Take one publisher off the graph. Do nothing after `close`, which removes all publishers."""
        with self._lock:
            if self._closed or publisher not in self._ends.publishers:
                return
            self._ends.publishers = tuple(
                end for end in self._ends.publishers if end is not publisher
            )
            if self._stay is not None:
                publisher.destroy(self._stay.node)
