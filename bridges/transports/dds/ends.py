"""The ends of the `dds` transport. An end is a publisher or a subscription.

The transport may leave the ROS graph and join it again, for example when the network changes. The end
remains, but its DDS writer or reader is replaced by a new one.
"""

import threading
import uuid
from collections import deque
from collections.abc import Callable, Hashable
from typing import Final, Protocol

from cyclonedds.core import DDSException, DDSStatus
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic

from bridges.messages import cdr, topics
from bridges.messages.cdr import CdrError
from bridges.messages.definitions import Message
from bridges.messages.releases import NEWEST, Release
from bridges.messages.rihs01 import type_hash
from bridges.messages.topics import AnyTopic
from bridges.transports import notices
from bridges.transports.dds.idl import IdlSample, sample_type
from bridges.transports.dds.peers import READING
from bridges.transports.peers import Peers
from bridges.transports.repeats import Repeats
from bridges.transports.senders import Senders
from bridges.transports.transport import Receive, TransportError

WRITE_BLOCKS_NS: Final = 20_000_000
"""The longest time (ns) for which a writer waits for a peer. It must be shorter than a scan, because
the writer holds Python's global lock while it waits."""
AT_ONCE: Final = 100
"""The maximum number of samples from one subscription before the other subscriptions have their
turn."""
MOST_GUIDS: Final = 1000
"""The number of publishers of one topic whose guids are remembered."""
POLICIES: Final = {2: "durability", 11: "reliability", 23: "data representation", 24: "type"}


class DdsPublisher:
    """The publisher of one topic. `withdraw(publisher)` removes the publisher's writer from the ROS
    graph."""

    def __init__(
        self,
        topic: AnyTopic,
        reader_thread: threading.Thread,
        withdraw: Callable[["DdsPublisher"], None],
    ) -> None:
        self.topic = topic
        self._withdraw = withdraw
        self._using = threading.Lock()
        self._writer: DataWriter = None
        self._reader_thread = reader_thread
        self._retained: deque[Message] = deque(maxlen=topic.repeats)
        self._sample: type[IdlSample] | None = None
        self._release = NEWEST

    watched = DDSStatus.OfferedIncompatibleQos

    def create(
        self, participant: DomainParticipant, topic: DdsTopic, release: Release
    ) -> DataWriter:
        """Make a writer, and return it. `begin` lets the publisher use it."""
        qos = _writer_qos(self.topic.publish, type_hash(self.topic.type, release))
        return DataWriter(participant, topic, qos=qos)

    def begin(self, writer: DataWriter, release: Release) -> None:
        """Publish with this writer from now on. First send the retained messages that still hold again,
        for late joiners."""
        with self._using:
            self._writer, self._release = writer, release
            self._sample = sample_type(self.topic.type, release)
            for message in self._retained:
                self._write(message)

    def drop(self) -> DataWriter:
        """Forget the writer. Return it, or None without one. The caller deletes it, or has deleted its
        participant."""
        with self._using:
            writer, self._writer = self._writer, None
        return writer

    def publish(self, message: Message) -> None:
        """Send a message. Block for at most 20 ms. Raises TransportError if the message was not sent,
        and CdrError if it cannot be encoded."""
        if not self._reader_thread.is_alive():
            raise TransportError(f"topic {self.topic.name}: closed, or the reader has died")
        with self._using:  # so that `begin` sends no older message after this one
            if self._retained.maxlen:  # otherwise cyclonedds alone encodes it
                cdr.encode(self.topic.type, message, self._release)  # `begin` must not fail
                self._retained.append(message)
            if self._writer is None:
                why = "there is no network, or RMF's release lacks the message"
                raise TransportError(f"topic {self.topic.name}: not sent: {why}")
            try:
                self._write(message)
            except DDSException as error:
                raise TransportError(f"topic {self.topic.name}: not sent: {error}") from error

    def matched(self) -> int:
        """Return the number of matched subscriptions. Return 0 after `close`."""
        writer = self._writer
        try:
            return len(writer.get_matched_subscriptions()) if writer else 0
        except DDSException:
            return 0

    def close(self) -> None:
        """Remove this publisher from the ROS graph."""
        self._withdraw(self)

    def _write(self, message: Message) -> None:
        assert self._sample is not None
        self._writer.write(self._sample(message))

    def log_misfits(self, peers: Peers) -> None:
        """Log each new subscription of this topic whose QoS does not match ours."""
        writer = self._writer
        if writer is None:
            return
        try:
            status = writer.get_offered_incompatible_qos_status()
        except DDSException:  # another thread has withdrawn this publisher
            return
        if status.total_count_change:
            _log_misfit(self.topic, notices.NOT_SERVED, status, peers)


class DdsSubscription:
    """The subscription of one topic. `dropped`: the number of invalid samples, by the topic's name.
    `owners(guids)` returns the nodes that own these writers."""

    def __init__(
        self,
        topic: AnyTopic,
        received: Receive,
        dropped: dict[str, int],
        owners: Callable[[list[bytes]], list[str]],
        senders: Senders,
        *,
        others_only: bool,
    ) -> None:
        self.topic = topic
        self._owners = owners
        self._senders = senders
        self._finds_node = self._node_of  # bound once, because each message needs it
        self._others_only = others_only
        self._repeats = Repeats(topic)
        self._reader: DataReader = None
        self._guids: dict[int, bytes] = {}
        self._received = received
        self._dropped = dropped

    watched = DDSStatus.RequestedIncompatibleQos

    def create(
        self, participant: DomainParticipant, topic: DdsTopic, release: Release
    ) -> DataReader:
        """Make the subscription's reader, which replaces an earlier reader. Return the reader."""
        hashed = type_hash(self.topic.type, release)
        qos = _reader_qos(self.topic.subscribe, hashed, others_only=self._others_only)
        self._guids = {}
        self._reader = DataReader(participant, topic, qos=qos)
        return self._reader

    def drop(self) -> None:
        """Forget the reader, because its participant has been deleted."""
        self._reader = None

    def matched(self) -> int:
        """Return the number of matched publishers. Return 0 after `close`."""
        reader = self._reader
        try:
            return len(reader.get_matched_publications()) if reader else 0
        except DDSException:
            return 0

    def senders(self) -> list[str]:
        """Return the nodes of the matched publishers. Return nothing until the nodes' announcements
        have arrived."""
        reader = self._reader
        try:
            handles = reader.get_matched_publications() if reader else []
        except DDSException:
            return []
        return self._nodes(handles)

    def _nodes(self, handles: list[int]) -> list[str]:
        """Return the nodes of these matched publishers. Leave out unknown nodes."""
        found = [guid for guid in map(self._guid, handles) if guid]
        try:
            return self._owners(found)
        except DDSException:
            return []

    def _guid(self, handle: int) -> bytes | None:
        """Return the guid of a matched publisher. Return None if the publisher has gone, or if its
        announcement cannot be read.

        Each announcement is read only once, because cyclonedds never frees the user data that it reads
        (11.0.1, about 100 bytes).
        """
        reader, guids = self._reader, self._guids
        if handle not in guids and reader is not None:
            try:
                with READING:
                    writer: _Writer | None = reader.get_matched_publication_data(handle)
            except Exception:  # noqa: BLE001 - a plain Exception, for example if a QoS is not UTF-8
                return None
            if writer is None:
                return None
            if len(guids) >= MOST_GUIDS:
                guids.clear()
            guids[handle] = writer.key.bytes
        return guids.get(handle)

    def _node_of(self, handle: Hashable) -> str:
        return next(iter(self._nodes([handle])), "")  # type: ignore[list-item]

    def take(self) -> bool:
        """Deliver the samples that have arrived. Return False if no sample has arrived."""
        if self._reader is None:
            return False
        senders = self._senders
        senders.node_of = self._finds_node
        for taken in range(AT_ONCE):
            try:
                samples = self._reader.take(1)
            except CdrError as error:
                notices.drop(self._dropped, self.topic, error)
                continue
            if not samples:
                return taken > 0
            info = samples[0].sample_info
            if not info.valid_data:  # a notice, such as of a publisher that has left
                continue
            message = samples[0].message
            if not self._repeats.has(info.source_timestamp, message):
                senders.key = info.publication_handle
                notices.hand_on(self._dropped, self.topic, self._received, message)
        return True

    def log_misfits(self, peers: Peers) -> None:
        """Log each new publisher of this topic whose QoS does not match ours."""
        if self._reader is None:
            return
        status = self._reader.get_requested_incompatible_qos_status()
        if status.total_count_change:
            _log_misfit(self.topic, notices.NOT_HEARD, status, peers)


class _Writer(Protocol):
    """DDS's announcement of a publisher. `key`: its guid"""

    key: uuid.UUID


class _Misfits(Protocol):
    """Cyclone's report on peers whose QoS does not match an end."""

    last_policy_id: int


def _log_misfit(topic: AnyTopic, text: str, status: _Misfits, peers: Peers) -> None:
    policy = POLICIES.get(status.last_policy_id, f"QoS policy {status.last_policy_id}")
    if policy == "type":
        peers.name(topic, published=text == notices.NOT_HEARD)
    else:
        notices.misfit(topic, text, policy)


def _writer_qos(qos: topics.Qos, hashed: str) -> Qos:
    if qos.durability == "volatile":
        return Qos(Policy.Durability.Volatile, *_policies(qos, hashed))
    # A node that joins late gets its history from the durability service. By default this service keeps
    # only the last message, so its depth is set too.
    retained = Policy.DurabilityService(0, Policy.History.KeepLast(qos.depth), -1, -1, -1)
    return Qos(Policy.Durability.TransientLocal, retained, *_policies(qos, hashed))


def _reader_qos(qos: topics.Qos, hashed: str, *, others_only: bool) -> Qos:
    durability = Policy.Durability
    wanted = durability.Volatile if qos.durability == "volatile" else durability.TransientLocal
    ignored = Policy.IgnoreLocal.Participant if others_only else Policy.IgnoreLocal.Nothing
    return Qos(wanted, ignored, *_policies(qos, hashed))


def _policies(qos: topics.Qos, hashed: str) -> list[object]:
    return [
        Policy.Reliability.Reliable(WRITE_BLOCKS_NS),
        Policy.History.KeepLast(qos.depth),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        Policy.Userdata(f"typehash={hashed};".encode()),
    ]
