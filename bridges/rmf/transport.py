"""What a transport does, whichever wire it speaks: `ros2`, `dds`, `zenoh`, `memory`.

One file each beside this one; `bridges/rmf/choose.py` opens the one that the YAML names.
"""

from collections.abc import Callable
from typing import Protocol, TypeVar

from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic

M = TypeVar("M", bound=Message)
M_contra = TypeVar("M_contra", bound=Message, contravariant=True)


class TransportError(Exception):
    """The transport cannot be opened, or has been lost: no network, no library, no such domain."""


class Publisher(Protocol[M_contra]):
    """The sending end of one topic."""

    def publish(self, message: M_contra) -> None:
        """Send; never blocks longer than 20 ms. Raises TransportError when the wire is gone."""

    def matched(self) -> int:
        """How many subscriptions, of any process, receive what is sent here."""

    def close(self) -> None:
        """Take this end off the graph at once; the node stays. May be called twice."""


class Subscription(Protocol):
    """The receiving end of one topic."""

    def matched(self) -> int:
        """How many publishers, of any process, are heard here."""


class Transport(Protocol):
    """One node on the RMF graph. `speaks`: the transport's name in a YAML.

    `received` is called on the transport's own thread. A callback must only append to an inbox and
    must not raise. Samples that do not decode, or whose callback raises, are dropped, counted in
    `dropped` by topic name, and logged once for each topic.
    """

    name: str
    speaks: str
    dropped: dict[str, int]

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher with `topic.publish` QoS."""

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Subscription:
        """Declare a subscription with `topic.subscribe` QoS.

        `others_only`: what this same transport publishes on the topic is not delivered to it.
        """

    @property
    def lives(self) -> bool:
        """It hears what comes. Without a network, a router or a peer it lives all the same."""

    def wall(self) -> float:
        """RMF's time, for stamps (s since the epoch): the wall clock, unless ROS simulates time."""

    def close(self) -> None:
        """Leave the graph at once, so that no ghost endpoint remains. May be called twice."""
