"""The interface of every transport: `ros2`, `dds`, `zenoh`.

Each transport has a folder beside this file. `bridges/transports/choose.py` opens the transport that
the YAML selects.
"""

from collections.abc import Callable
from typing import Protocol, TypeVar, cast

from bridges.messages.definitions import Message
from bridges.messages.heard import Sender
from bridges.messages.releases import Release
from bridges.messages.topics import Topic

M = TypeVar("M", bound=Message)
M_contra = TypeVar("M_contra", bound=Message, contravariant=True)


Receive = Callable[[Message], None]
"""A callback for a message of any type."""


def any_type(received: Callable[[M], None]) -> Receive:
    """Return a subscription's callback as a `Receive`. Transports store all callbacks as this type.

    The cast is safe, because a transport decodes each message as the type of the subscription's topic.
    """
    return cast(Receive, received)


class TransportError(Exception):
    """The error of a transport that cannot be opened or is lost, because a network, a library or a ROS
    domain is missing."""


class Publisher(Protocol[M_contra]):
    """The sending end of one topic."""

    def publish(self, message: M_contra) -> None:
        """Send a message. Block for at most 20 ms. Raises TransportError without a connection, and
        CdrError for a message that cannot be encoded."""

    def matched(self) -> int:
        """Return the number of subscriptions, in all processes, that receive our messages. Return 0
        after `close`."""

    def close(self) -> None:
        """Take this publisher off the graph at once. Its node stays on the graph. A second call does
        nothing."""


class Subscription(Protocol):
    """The receiving end of one topic."""

    def matched(self) -> int:
        """Return the number of publishers, in all processes, that this subscription hears. Return 0
        after `close`."""

    def senders(self) -> list[str]:
        """Return the nodes of the heard publishers, as `/namespace/name`. Leave out unknown nodes.
        Anybody can forge a name. Any thread may call this method."""


class Transport(Protocol):
    """One node on the RMF graph. `speaks`: the transport's name in a YAML. `domain_id`: the node's ROS
    domain.

    The transport's own thread calls the callback `received` of a subscription. This callback must only
    append to an inbox, and must not raise.

    A sample is dropped if it does not decode, or if its callback raises. `dropped` counts the dropped
    samples by the topic's name. The first dropped sample of each topic is logged.
    """

    name: str
    speaks: str
    domain_id: int
    dropped: dict[str, int]

    @property
    def release(self) -> Release:
        """The RMF release whose messages the node uses now."""

    def faults(self) -> list[tuple[str, str]]:
        """Return the code and the detail of each present fault that keeps this node and other nodes
        from hearing each other. Any thread may call this method."""

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher with `topic.publish` QoS."""

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Subscription:
        """Declare a subscription with `topic.subscribe` QoS.

        `others_only`: the subscription does not receive messages of this transport's own publishers.
        """

    def sender(self) -> Sender | None:
        """Return the publisher of the message that `received` now takes. Return None if the protocol
        does not name the publisher. Only the callback `received` may call this method."""

    @property
    def lives(self) -> bool:
        """Return whether the transport's thread runs. It runs even without a network, a router or a
        peer."""

    def wall(self) -> float:
        """Return RMF's time for stamps (s since the epoch). This is the wall clock, or ROS's simulated
        time."""

    def close(self) -> None:
        """Leave the graph at once, so that other nodes do not still see a dead endpoint. A second call
        does nothing."""
