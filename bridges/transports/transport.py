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
    """Return a subscription's callback, cast to the type that transports store for every topic.

    The cast is safe, because a transport decodes each message as the type of the subscription's topic.
    """
    return cast(Receive, received)


class TransportError(Exception):
    """The error of a transport that cannot be opened or has been lost. The network, library or domain
    is missing."""


class Publisher(Protocol[M_contra]):
    """The sending end of one topic."""

    def publish(self, message: M_contra) -> None:
        """Send a message. The call blocks for at most 20 ms. Raises TransportError without a
        connection."""

    def matched(self) -> int:
        """Return the number of subscriptions, in any process, that receive our messages; 0 after
        close."""

    def close(self) -> None:
        """Take this publisher off the graph at once. Its node stays. The caller may call `close`
        twice."""


class Subscription(Protocol):
    """The receiving end of one topic."""

    def matched(self) -> int:
        """Return the number of publishers, in any process, that this subscription hears; 0 after
        close."""

    def senders(self) -> list[str]:
        """Return the known nodes of the heard publishers, as `/namespace/name`. Anybody can forge a
        name. Any thread may call this."""


class Transport(Protocol):
    """One node on the RMF graph. `speaks`: the transport's name in a YAML. `domain_id`: its ROS domain.

    The transport's own thread calls `received`. A callback must only append to an inbox and must not
    raise. If a sample does not decode, or its callback raises, the sample is dropped. The drop is
    counted in `dropped` (topic name -> number), and logged once for each topic.
    """

    name: str
    speaks: str
    domain_id: int
    dropped: dict[str, int]

    @property
    def release(self) -> Release:
        """The release of RMF's messages that the node speaks at present."""

    def faults(self) -> list[tuple[str, str]]:
        """Return (code, detail) of each present fault that keeps this node and others from hearing each
        other. Any thread may call this."""

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher with `topic.publish` QoS."""

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Subscription:
        """Declare a subscription with `topic.subscribe` QoS.

        `others_only`: the subscription does not receive messages of this transport's own publishers.
        """

    def sender(self) -> Sender | None:
        """Return the publisher of the message that `received` takes now; None if the wire hides it.
        Only that callback may call this."""

    @property
    def lives(self) -> bool:
        """Does the transport's thread run? The answer is True even without a network, a router or a
        peer."""

    def wall(self) -> float:
        """Return RMF's time for stamps (s since the epoch): the wall clock, or ROS's simulated time."""

    def close(self) -> None:
        """Leave the graph at once, so that no ghost endpoint remains. The caller may call `close`
        twice."""
