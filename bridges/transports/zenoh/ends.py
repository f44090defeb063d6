"""The ends of the `zenoh` transport. An end is a publisher or a subscription.

The ends work as in rmw_zenoh (jazzy: rmw_publisher_data.cpp, rmw_subscription_data.cpp):

- A publisher that retains messages is an advanced publisher of zenoh. Its cache holds as many messages
  as its history.
- A subscription that wants retained messages is an advanced subscriber of zenoh. It queries a
  publisher's cache when the publisher or the subscription is new. It also queries the cache for missed
  samples.

The transport may leave the session and join a new one, for example when the network changes. The end
remains, and gets a new `Place`, which is its presence in one session. Callbacks on zenoh's threads only
queue work for the transport's thread.
"""

import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Hashable
from functools import partial
from typing import Final, Protocol

import zenoh
from zenoh import CongestionControl, Locality, Reliability, Sample, SampleKind, ext
from zenoh.handlers import Callback

from bridges.messages import cdr
from bridges.messages.cdr import CdrError
from bridges.messages.definitions import Message
from bridges.messages.releases import NEWEST
from bridges.messages.topics import AnyTopic
from bridges.transports import notices
from bridges.transports.repeats import Repeats
from bridges.transports.senders import Senders
from bridges.transports.transport import Receive, TransportError
from bridges.transports.zenoh import keys as zenoh_keys
from bridges.transports.zenoh.keys import Keys, Kind
from bridges.transports.zenoh.peers import Merged, Order
from bridges.transports.zenoh.place import Place, Tell
from bridges.transports.zenoh.session import contained

HEARTBEAT_S: Final = 0.5
"""The interval (s) at which a publisher repeats the number of its last retained message, so that
subscribers notice a lost message. rmw_zenoh uses the same value."""
AT_ONCE: Final = 100
"""The maximum number of samples from one subscription before the other subscriptions have their
turn."""


class Declared(Protocol):
    """A publisher or subscriber in a zenoh session."""

    def undeclare(self) -> object:
        """Take this publisher or subscriber off the graph."""


class ZenohEnd(ABC):
    """The base of publishers and subscriptions. `do(order)` queues a function for the transport's
    thread. `tell` is a callback (see `Place`)."""

    def __init__(
        self, topic: AnyTopic, notice: str, do: Callable[[Order], None], tell: Tell
    ) -> None:
        self.topic = topic
        self.place: Place | None = None
        self._end: Declared | None = None
        self._notice = notice
        self._noticed: set[str] = set()
        self._do = do
        self._tell = tell
        self._release = NEWEST

    @abstractmethod
    def create(self, session: zenoh.Session, keys: Keys, number: int) -> None:
        """Declare this end in a session. `number` is unique in the session."""

    def _placed(self, session: zenoh.Session, keys: Keys, kind: Kind, number: int) -> Place:
        misfit, tell, do = self.log_misfit, self._tell, self._do
        return Place(session, keys, kind, self.topic, number, misfit, tell, do)

    def leave(self) -> None:
        """Remove this end from its session, which stays open for other ends."""
        place, self.place = self.place, None
        end, self._end = self._end, None
        if place and end:
            place.leave()
            end.undeclare()

    def give_up(self) -> object:
        """Leave a session that will soon be closed. Return the objects that the end declared in the
        session."""
        held = self.place, self._end
        self.place = self._end = None
        return held

    def log_misfit(self, policy: str) -> None:
        """Log that a peer's QoS does not fit. Log each policy only once."""
        if policy not in self._noticed:
            self._noticed.add(policy)
            self._do(partial(notices.misfit, self.topic, self._notice, policy))


class ZenohPublisher(ZenohEnd):
    """The publisher of one topic.

    - `withdraw(publisher)` removes the publisher from the ROS graph.
    - `lives()` returns whether the transport is open and its thread runs.
    - `deaf`: the tokens of this node's own subscriptions that must not receive this publisher's
      messages
    """

    _end: zenoh.Publisher | ext.AdvancedPublisher | None

    def __init__(
        self,
        topic: AnyTopic,
        do: Callable[[Order], None],
        withdraw: Callable[["ZenohPublisher"], None],
        lives: Callable[[], bool],
        deaf: set[str],
        tell: Tell,
    ) -> None:
        super().__init__(topic, notices.NOT_SERVED, do, tell)
        self._withdraw = withdraw
        self._lives = lives
        self._deaf = deaf
        self._using = threading.Lock()
        self._sent = 0
        self._retained: deque[bytes] = deque(maxlen=topic.repeats)

    def create(self, session: zenoh.Session, keys: Keys, number: int) -> None:
        """Declare this publisher in a session. Send the retained messages that still hold again, for
        nodes that join late."""
        place = self._placed(session, keys, "MP", number)
        end = self._declared(session, place.key)
        place.appear()
        with self._using:
            self._release, self._end = keys.release, end
            self.place, self._sent = place, 0
            for sample in self._retained:
                self._put(end, place, sample)

    def publish(self, message: Message) -> None:
        """Send a message. Raises TransportError if the message was not sent, and CdrError if it cannot
        be encoded."""
        if not self._lives():
            raise TransportError(f"topic {self.topic.name}: closed, or the reader has died")
        with self._using:  # so that `create` sends no older message after this one
            sample = cdr.encode(self.topic.type, message, self._release)
            self._retained.append(sample)
            place, end = self.place, self._end  # copies: another thread may clear the attributes
            if place is None or end is None:
                why = "the node is not on the graph"
                raise TransportError(f"topic {self.topic.name}: not sent: {why}")
            try:
                with contained():
                    self._put(end, place, sample)
            except zenoh.ZError as error:
                raise TransportError(f"topic {self.topic.name}: not sent: {error}") from error

    def matched(self) -> int:
        """Return the number of subscriptions that hear this publisher. Return 0 after `close`."""
        place = self.place
        return len(place.peers.keys() - self._deaf) if place else 0

    def close(self) -> None:
        """Remove this publisher from the ROS graph."""
        self._withdraw(self)

    def _declared(
        self, session: zenoh.Session, key: str
    ) -> zenoh.Publisher | ext.AdvancedPublisher:
        # With DROP, zenoh waits at most 1 ms for room in the queue to a peer.
        congestion, reliable = CongestionControl.DROP, Reliability.RELIABLE
        if self.topic.publish.durability == "volatile":
            return session.declare_publisher(
                key, congestion_control=congestion, reliability=reliable
            )
        return ext.declare_advanced_publisher(
            session,
            key,
            congestion_control=congestion,
            reliability=reliable,
            cache=ext.CacheConfig(max_samples=self.topic.publish.depth),
            sample_miss_detection=ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=HEARTBEAT_S
            ),
            publisher_detection=True,
        )

    def _put(
        self, end: zenoh.Publisher | ext.AdvancedPublisher, place: Place, sample: bytes
    ) -> None:
        self._sent += 1
        attached = zenoh_keys.attachment(self._sent, time.time_ns(), place.gid)
        end.put(sample, attachment=attached)


class ZenohSubscription(ZenohEnd):
    """The subscription of one topic.

    - `dropped`: the number of invalid samples, by the topic's name
    - `others_only`: ignore the messages of this node's own publishers
    - `attached`: accept only samples that have the attachment (extra data) of a ROS node
    """

    def __init__(
        self,
        topic: AnyTopic,
        received: Receive,
        do: Callable[[Order], None],
        dropped: dict[str, int],
        senders: Senders,
        *,
        others_only: bool,
        attached: bool,
        tell: Tell,
    ) -> None:
        super().__init__(topic, notices.NOT_HEARD, do, tell)
        self.others_only = others_only
        self._senders = senders
        self._finds_node = self._node_of  # bound once, because each message needs it
        self._ring = Merged(do, self.take)
        self._own_session = ""
        self._received = received
        self._dropped = dropped
        self._attached = attached
        self._repeats = Repeats(topic)
        self._waiting: deque[Sample | CdrError] = deque(maxlen=topic.subscribe.depth)

    def create(self, session: zenoh.Session, keys: Keys, number: int) -> None:
        """Declare this subscription in a session."""
        place = self._placed(session, keys, "MS", number)
        self._release = keys.release
        self.place, self._own_session = place, keys.session
        origin = Locality.REMOTE if self.others_only else Locality.ANY
        on_sample = Callback(self._arrived, indirect=False)
        if self.topic.subscribe.durability == "volatile":
            self._end = session.declare_subscriber(place.key, on_sample, allowed_origin=origin)
        else:
            depth = self.topic.subscribe.depth
            self._end = ext.declare_advanced_subscriber(
                session,
                place.key,
                on_sample,
                allowed_origin=origin,
                history=ext.HistoryConfig(detect_late_publishers=True, max_samples=depth),
                recovery=ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
                subscriber_detection=True,
            )
        place.appear()

    def matched(self) -> int:
        """Return the number of publishers that this subscription hears. Return 0 after `close`."""
        return len(self.senders())

    def senders(self) -> list[str]:
        """Return the nodes of the publishers that this subscription hears."""
        place = self.place
        peers = list(place.peers.values()) if place else []
        ours = self._own_session if self.others_only else ""
        return [peer.node for peer in peers if peer.session != ours]

    def _node_of(self, gid: Hashable) -> str:
        peers = list(self.place.peers.items()) if self.place else []
        return next((peer.node for token, peer in peers if zenoh_keys.gid(token) == gid), "")

    def take(self) -> None:
        """Deliver at most AT_ONCE of the arrived samples. The remaining samples wait for the next
        turn."""
        self._senders.node_of = self._finds_node
        for _ in range(min(AT_ONCE, len(self._waiting))):
            try:
                message = self._message(self._waiting.popleft())
            except CdrError as error:
                notices.drop(self._dropped, self.topic, error)
                continue
            if message is not None:
                notices.hand_on(self._dropped, self.topic, self._received, message)
        if self._waiting:
            self._ring()

    def _arrived(self, sample: Sample) -> None:
        """Queue a sample. zenoh's thread calls this method. A full queue drops its oldest sample, as
        KEEP_LAST demands."""
        size = len(sample.payload)
        long = size > cdr.longest(self.topic.type)
        self._waiting.append(CdrError(f"{size} bytes long") if long else sample)
        self._ring()

    def _message(self, sample: Sample | CdrError) -> Message | None:
        """Return the message of a sample. Return None if the subscription must not hear the sample's
        publisher, or has heard the same sample before. Raises CdrError."""
        if isinstance(sample, CdrError):
            raise sample
        place = self.place
        if place is None:
            return None
        if sample.kind != SampleKind.PUT or str(sample.key_expr) != place.key:
            raise CdrError(f"no message: sent to {sample.key_expr}, or a deletion of a key")
        attached = None if sample.attachment is None else bytes(sample.attachment)
        sender = None if attached is None else zenoh_keys.sender(attached)
        if sender is None and self._attached:
            raise CdrError("without the attachment of a ROS node")
        if sender in place.unheard:
            return None
        self._senders.key = sender
        message = cdr.decode(self.topic.type, bytes(sample.payload), self._release)
        sent = attached or (sample.timestamp and str(sample.timestamp))
        return None if self._repeats.has(sent, message) else message
