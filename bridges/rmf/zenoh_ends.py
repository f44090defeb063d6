"""The ends of the `zenoh` transport: what a publisher and a subscription are in zenoh.

As rmw_zenoh makes them (jazzy: rmw_publisher_data.cpp, rmw_subscription_data.cpp): who retains
messages is an advanced publisher with a cache as deep as the history; who wants them is an advanced
subscriber, which asks each such cache when either side is new, and asks again for what it has missed.

An end outlives its session: when the transport joins anew, it is given its place in the new one.
What zenoh calls on its own threads only puts something down for ours.
"""

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any, Final, Generic, TypeVar

import zenoh
from zenoh import CongestionControl, Locality, Reliability, Sample, SampleKind, ext
from zenoh.handlers import Callback

from bridges.rmf import cdr, notices, zenoh_keys
from bridges.rmf.cdr import CdrError
from bridges.rmf.definitions import Message
from bridges.rmf.peers import Announced
from bridges.rmf.releases import NEWEST
from bridges.rmf.rihs01 import type_hash
from bridges.rmf.topics import Topic
from bridges.rmf.transport import TransportError
from bridges.rmf.zenoh_keys import Keys, Kind

M = TypeVar("M", bound=Message)

Tell = Callable[[str, Announced | None], None]

HEARTBEAT_S: Final = 0.5
"""As rmw_zenoh: after a retained message, its number is told once more, so that a loss shows."""
LONGEST: Final = 1 << 20
"""Bytes of a sample that may wait for our thread: far above any message of RMF, and a hundred of them
fit into a small Pi."""
AT_ONCE: Final = 100
"""Samples taken from one subscription before the others have their turn."""


class Place:
    """An end's place in one session: its token, and the tokens of those on the other side.

    `stranger(token, policy)`: called on zenoh's thread for a peer whose QoS does not fit. `tell(token,
    end)`: likewise for each that comes, and with None when it goes.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        kind: Kind,
        topic: Topic[Any],
        number: int,
        stranger: Callable[[str, str], None],
        tell: Tell,
    ) -> None:
        self.key = keys.data(topic)
        self.token = keys.token(kind, topic, number)
        self.gid = zenoh_keys.gid(self.token)
        self.peers: dict[str, zenoh_keys.End] = {}
        self.unheard: set[bytes] = set()
        self._keys = keys
        self._kind = kind
        self._topic = topic
        self._stranger = stranger
        self._tell = tell
        retained = topic.publish if kind == "MP" else topic.subscribe
        self._transient_local = retained.durability == "transient_local"
        self._live = session.liveliness()
        self._watching = self._live.declare_subscriber(
            keys.others("MS" if kind == "MP" else "MP", topic),
            Callback(self._look, indirect=False),
            history=True,
        )
        self._alive: zenoh.LivelinessToken | None = None

    def appear(self) -> None:
        """Let the others know, now that the end sends or hears."""
        self._alive = self._live.declare_token(self.token)

    def leave(self) -> None:
        """Take the token back."""
        if self._alive:
            self._alive.undeclare()  # type: ignore[no-untyped-call]
        self._watching.undeclare()  # type: ignore[no-untyped-call]

    def _look(self, sample: Sample) -> None:
        """A token has come or gone; on zenoh's thread."""
        token = str(sample.key_expr)
        if sample.kind == SampleKind.DELETE:
            self.peers.pop(token, None)
            self.unheard.discard(zenoh_keys.gid(token))
            self._tell(token, None)
        elif (end := self._keys.end(token)) is None:
            return
        else:
            self._tell(token, end.announced)
            self._meet(token, end)

    def _meet(self, token: str, end: zenoh_keys.End) -> None:
        policy = self._misfit(end)
        if not policy:
            self.peers[token] = end
            return
        self.unheard.add(zenoh_keys.gid(token))
        if policy != "type":  # which `peers.py` tells, of all ends
            self._stranger(token, policy)

    def _misfit(self, theirs: zenoh_keys.End) -> str:
        """Which policy keeps the two apart, as DDS has it; "" for none."""
        hashed = type_hash(self._topic.type, self._keys.release)
        if theirs.type != self._keys.type(self._topic) or theirs.announced.hash not in ("", hashed):
            return "type"
        wants, keeps = theirs.transient_local, self._transient_local
        if self._kind == "MS":
            wants, keeps = keeps, wants
        return "durability" if wants and not keeps else ""


class _End:
    """What both ends have. `do`: has something done on the transport's thread. `tell`: as `Place`."""

    def __init__(
        self, topic: Topic[Any], text: str, do: Callable[[Callable[[], None]], None], tell: Tell
    ) -> None:
        self.place: Place | None = None
        self._end: Any = None
        self._notice = (topic, text)
        self._named: set[str] = set()
        self._do = do
        self._tell = tell

    def leave(self) -> None:
        """Give up the place in a session that goes on."""
        place, self.place = self.place, None
        if place:
            place.leave()
            self._end.undeclare()

    def give_up(self) -> object:
        """Give up the place in a session that ends: what was declared in it."""
        held = self.place, self._end
        self.place = self._end = None
        return held

    def name_stranger(self, token: str, policy: str) -> None:
        """Name a peer that does not fit, once."""
        if token not in self._named:
            self._named.add(token)
            self._do(partial(notices.misfit, *self._notice, policy))


class ZenohPublisher(_End, Generic[M]):
    """One topic's sending end. `withdraw`: takes it off the graph. `lives`: the transport is there
    and its thread hears. `deaf`: tokens of our own subscriptions that do not want to hear us."""

    def __init__(
        self,
        topic: Topic[M],
        do: Callable[[Callable[[], None]], None],
        withdraw: Callable[["ZenohPublisher[Any]"], None],
        lives: Callable[[], bool],
        deaf: set[str],
        tell: Tell,
    ) -> None:
        super().__init__(topic, notices.NOT_SERVED, do, tell)
        self.topic = topic
        self._withdraw = withdraw
        self._lives = lives
        self._deaf = deaf
        self._sent = 0
        self._release = NEWEST
        depth = topic.publish.depth if topic.publish.durability == "transient_local" else 0
        self._retained: deque[bytes] = deque(maxlen=depth)

    def create(self, session: zenoh.Session, keys: Keys, number: int) -> None:
        """Take a place in a session; what was retained goes out again for late joiners."""
        place = Place(session, keys, "MP", self.topic, number, self.name_stranger, self._tell)
        self._release = keys.release
        self._end = self._declared(session, place.key)
        place.appear()
        self.place, self._sent = place, 0
        for sample in list(self._retained):
            self._put(self._end, place, sample)

    def publish(self, message: M) -> None:
        """Send. Raises TransportError when it was not sent, CdrError for what no sample can hold."""
        if not self._lives():
            raise TransportError(f"topic {self.topic.name}: closed, or the reader has died")
        sample = cdr.encode(self.topic.type, message, self._release)
        self._retained.append(sample)
        place, end = self.place, self._end  # another thread may give them up meanwhile
        if place is None or end is None:
            raise TransportError(f"topic {self.topic.name}: not sent: this end has no session")
        try:
            self._put(end, place, sample)
        except zenoh.ZError as error:
            raise TransportError(f"topic {self.topic.name}: not sent: {error}") from error

    def matched(self) -> int:
        """How many subscriptions are reached; 0 after close."""
        place = self.place
        return len(place.peers.keys() - self._deaf) if place else 0

    def close(self) -> None:
        """Take this end off the graph."""
        self._withdraw(self)

    def _declared(self, session: zenoh.Session, key: str) -> Any:
        # DROP waits for 1 ms at most for room in the queue to a peer.
        congestion, reliable = CongestionControl.DROP, Reliability.RELIABLE
        if not self._retained.maxlen:
            return session.declare_publisher(
                key, congestion_control=congestion, reliability=reliable
            )
        return ext.declare_advanced_publisher(
            session,
            key,
            congestion_control=congestion,
            reliability=reliable,
            cache=ext.CacheConfig(max_samples=self._retained.maxlen),
            sample_miss_detection=ext.MissDetectionConfig(
                heartbeat=None, sporadic_heartbeat=HEARTBEAT_S
            ),
            publisher_detection=True,
        )

    def _put(self, end: Any, place: Place, sample: bytes) -> None:
        self._sent += 1
        attached = zenoh_keys.attachment(self._sent, time.time_ns(), place.gid)
        end.put(sample, attachment=attached)


class ZenohSubscription(_End, Generic[M]):
    """One topic's receiving end. `ring`: tells the transport's thread that something has come.
    `attached`: a sample without an attachment is none of a ROS node. `dropped`: counts samples that
    are no messages, by topic."""

    def __init__(
        self,
        topic: Topic[M],
        received: Callable[[M], None],
        do: Callable[[Callable[[], None]], None],
        dropped: dict[str, int],
        *,
        others_only: bool,
        attached: bool,
        tell: Tell,
    ) -> None:
        super().__init__(topic, notices.NOT_HEARD, do, tell)
        self.topic = topic
        self.others_only = others_only
        self._rung = False
        self._own_session = ""
        self._received = received
        self._dropped = dropped
        self._attached = attached
        self._release = NEWEST
        self._waiting: deque[Sample | CdrError] = deque(maxlen=topic.subscribe.depth)

    def create(self, session: zenoh.Session, keys: Keys, number: int) -> None:
        """Take a place in a session."""
        place = Place(session, keys, "MS", self.topic, number, self.name_stranger, self._tell)
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
        """How many publishers are heard; 0 after close."""
        place = self.place
        peers = list(place.peers.values()) if place else []
        return sum(not self.others_only or peer.session != self._own_session for peer in peers)

    def take(self) -> None:
        """Hand on what has arrived; what is more than the others' turn allows waits for the next."""
        self._rung = False
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

    def _ring(self) -> None:
        if not self._rung:
            self._rung = True
            self._do(self.take)

    def _arrived(self, sample: Sample) -> None:
        """On zenoh's thread. When too much waits, the oldest goes: the history is KEEP_LAST."""
        size = len(sample.payload)
        self._waiting.append(CdrError(f"{size} bytes long") if size > LONGEST else sample)
        self._ring()

    def _message(self, sample: Sample | CdrError) -> M | None:
        """The message in a sample; None from a publisher that we do not hear."""
        if isinstance(sample, CdrError):
            raise sample
        place = self.place
        if place is None:
            return None
        if sample.kind != SampleKind.PUT or str(sample.key_expr) != place.key:
            raise CdrError(f"sent to {sample.key_expr}, or a deletion")
        attached = sample.attachment
        sender = None if attached is None else zenoh_keys.sender(bytes(attached))
        if sender is None and self._attached:
            raise CdrError("without the attachment of a ROS node")
        if sender in place.unheard:
            return None
        return cdr.decode(self.topic.type, bytes(sample.payload), self._release)
