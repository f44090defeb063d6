"""The `dds` transport: ROS 2's wire without ROS, by cyclonedds 11.0.1.

Names, types and QoS are those that rmw_cyclonedds and rmw_fastrtps use: topic `rt/<name>`, type
`<package>::msg::dds_::<Type>_`, plain CDR, the type hash in the endpoint's user data.

One thread reads for all subscriptions. Whatever arrives, it goes on: a sample that is not a message
is dropped, counted, and logged once for its topic. (Cyclone's C library refuses samples that do not
fit the type before they come here, and says so on stderr.) A thread that has died all the same
shows at the next publish.

cyclonedds is imported here, in idl.py and in graph.py, and these three only by choose.py.
"""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final, Generic, TypeVar
from weakref import WeakValueDictionary

from cyclonedds import core
from cyclonedds.core import DDSException, DDSStatus
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import dds_infinity
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic

from bridges.log import pairs
from bridges.rmf import notices, topics
from bridges.rmf.cdr import CdrError
from bridges.rmf.definitions import Message
from bridges.rmf.graph import NodeOnGraph
from bridges.rmf.idl import sample_type
from bridges.rmf.loopback import LOOPBACK
from bridges.rmf.rihs01 import type_hash
from bridges.rmf.topics import Topic
from bridges.rmf.transport import TransportError

log = logging.getLogger(__name__)

M = TypeVar("M", bound=Message)

CANNOT_JOIN: Final = (
    "is a network interface up, and does CYCLONEDDS_URI, if set, name one that exists? "
    "`network: localhost` needs none. Cannot join DDS domain"
)
WRITE_BLOCKS_NS: Final = 20_000_000
"""A writer that waits for a peer holds Python's lock meanwhile: keep it below one scan."""
AT_ONCE: Final = 100
"""Samples taken from one subscription before the others have their turn."""
ANY_SAMPLE: Final = core.SampleState.Any | core.ViewState.Any | core.InstanceState.Any
POLICIES: Final = {2: "durability", 11: "reliability", 23: "data representation", 24: "type"}

_domains: WeakValueDictionary[int, Any] = WeakValueDictionary()
_domains_lock = threading.Lock()


class DdsTransport:
    """One node: a participant, its reader thread, its publishers and subscriptions.

    `loopback`: stay on this machine whatever CYCLONEDDS_URI says; otherwise Cyclone's own
    configuration stands. The interface is the one that is up now: `_join` is where a later one
    would be taken. Raises TransportError when the domain cannot be joined.
    """

    def __init__(self, node_name: str, domain_id: int, *, loopback: bool) -> None:
        self.name = node_name
        self.dropped: dict[str, int] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._entities: list[Any] = []
        self._topics: dict[str, Any] = {}
        self._ends: tuple[_Publisher[Any] | _Subscription[Any], ...] = ()
        self._subscriptions: tuple[_Subscription[Any], ...] = ()
        try:
            with self._reporting(f"{CANNOT_JOIN} {domain_id}"):
                self._join(domain_id, loopback=loopback)
        except TransportError:
            self._delete_entities()
            raise
        self._thread = threading.Thread(target=self._read, name=f"{node_name}-dds", daemon=True)
        self._thread.start()

    def publisher(self, topic: Topic[M]) -> "_Publisher[M]":
        """Declare a publisher with `topic.publish` QoS."""
        with self._lock, self._reporting(f"topic {topic.name} cannot be published"):
            qos = _writer_qos(topic.publish, topic.type)
            writer = self._keep(DataWriter(self._participant, self._topic(topic), qos=qos))
            publisher = _Publisher(topic, writer, self._thread, self._withdraw)
            self._watch(publisher, writer, DDSStatus.OfferedIncompatibleQos)
            self._node.add_writer(writer)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> "_Subscription[M]":
        """Declare a subscription with `topic.subscribe` QoS; `received` runs on our thread."""
        with self._lock, self._reporting(f"topic {topic.name} cannot be subscribed"):
            qos = _reader_qos(topic.subscribe, topic.type, others_only=others_only)
            reader = self._keep(DataReader(self._participant, self._topic(topic), qos=qos))
            subscription = _Subscription(topic, reader, received, self.dropped)
            self._subscriptions += (subscription,)
            self._watch(subscription, reader, DDSStatus.RequestedIncompatibleQos)
            self._waitset.attach(self._keep(core.ReadCondition(reader, ANY_SAMPLE)))
            self._node.add_reader(reader)
        return subscription

    def wall(self) -> float:
        """The wall clock (s since the epoch)."""
        return time.time()

    def close(self) -> None:
        """Leave the graph at once. Each entity is deleted by name: none waits for a collector."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._leaving.set(True)
        if threading.current_thread() is not self._thread:
            self._thread.join()
        self._delete_entities()

    def _join(self, domain_id: int, *, loopback: bool) -> None:
        self._domain = _loopback_domain(domain_id) if loopback else None
        userdata = Qos(Policy.Userdata(b"enclave=/;"))
        self._participant = self._keep(DomainParticipant(domain_id, qos=userdata))
        self._waitset = self._keep(core.WaitSet(self._participant))
        self._leaving = self._keep(core.GuardCondition(self._participant))
        self._waitset.attach(self._leaving)
        self._node = NodeOnGraph(self._participant, self.name)
        self._entities += [self._node.topic, self._node.writer]

    def _topic(self, topic: Topic[M]) -> Any:
        name = f"rt/{topic.name}"
        if name not in self._topics:
            kind = sample_type(topic.type)
            self._topics[name] = self._keep(DdsTopic(self._participant, name, kind))
        return self._topics[name]

    def _watch(self, end: "_Publisher[M] | _Subscription[M]", entity: Any, status: int) -> None:
        self._ends += (end,)
        entity.set_status_mask(status)
        self._waitset.attach(entity)

    def _read(self) -> None:
        try:
            while not self._closed:
                self._waitset.wait(dds_infinity)
                taken = [subscription.take() for subscription in self._subscriptions]
                if not any(taken):
                    for end in self._ends:
                        end.log_misfits()
        except DDSException as error:
            log.error(pairs("reader_lost", node=self.name, reason=error))

    def _withdraw(self, publisher: "_Publisher[Any]", writer: Any) -> None:
        """Take one writer off the graph; after close there is none left to take."""
        with self._lock:
            if self._closed or publisher not in self._ends:
                return
            self._ends = tuple(end for end in self._ends if end is not publisher)
            self._waitset.detach(writer)
            self._node.drop_writer(writer)
            self._entities = [entity for entity in self._entities if entity is not writer]
            writer.__del__()

    def _keep(self, entity: Any) -> Any:
        self._entities.append(entity)
        return entity

    def _delete_entities(self) -> None:
        while self._entities:
            self._entities.pop().__del__()  # deletes the C entity, and a second time nothing
        self._domain = None

    @contextmanager
    def _reporting(self, text: str) -> Iterator[None]:
        if self._closed:
            raise TransportError(f"{text}: {self.name} has left the graph")
        try:
            yield
        except DDSException as error:
            raise TransportError(f"{text}: {error}") from error


class _Publisher(Generic[M]):
    def __init__(
        self,
        topic: Topic[M],
        writer: Any,
        reader_thread: threading.Thread,
        withdraw: Callable[["_Publisher[Any]", Any], None],
    ) -> None:
        self._withdraw = withdraw
        self._topic = topic
        self._writer = writer
        self._reader_thread = reader_thread
        self._sample = sample_type(topic.type)

    def publish(self, message: M) -> None:
        """Send; blocks for 20 ms at most. Raises TransportError when it was not sent."""
        if not self._reader_thread.is_alive():
            raise TransportError(f"topic {self._topic.name}: closed, or the reader has died")
        try:
            self._writer.write(self._sample(message))
        except DDSException as error:
            raise TransportError(f"topic {self._topic.name}: not sent: {error}") from error

    def matched(self) -> int:
        """How many subscriptions are reached; 0 after close."""
        try:
            return len(self._writer.get_matched_subscriptions())
        except DDSException:
            return 0

    def close(self) -> None:
        """Take this end off the graph."""
        self._withdraw(self, self._writer)

    def log_misfits(self) -> None:
        """Say that a subscription of this topic cannot be served, when there is a new one."""
        status = self._writer.get_offered_incompatible_qos_status()
        if status.total_count_change:
            _log_misfit(self._topic, notices.NOT_SERVED, status)


class _Subscription(Generic[M]):
    def __init__(
        self,
        topic: Topic[M],
        reader: Any,
        received: Callable[[M], None],
        dropped: dict[str, int],
    ) -> None:
        self._topic = topic
        self._reader = reader
        self._received = received
        self._dropped = dropped

    def matched(self) -> int:
        """How many publishers are heard; 0 after close."""
        try:
            return len(self._reader.get_matched_publications())
        except DDSException:
            return 0

    def take(self) -> bool:
        """Hand on what has arrived; False when nothing had."""
        for taken in range(AT_ONCE):
            try:
                samples = self._reader.take(1)
            except CdrError as error:
                notices.drop(self._dropped, self._topic, error)
                continue
            if not samples:
                return taken > 0
            if samples[0].sample_info.valid_data:
                self._received(samples[0].message)
        return True

    def log_misfits(self) -> None:
        """Say that a publisher of this topic cannot be heard, when there is a new one."""
        status = self._reader.get_requested_incompatible_qos_status()
        if status.total_count_change:
            _log_misfit(self._topic, notices.NOT_HEARD, status)


def _log_misfit(topic: Topic[M], text: str, status: Any) -> None:
    policy = POLICIES.get(status.last_policy_id, f"QoS policy {status.last_policy_id}")
    notices.misfit(topic, text, policy)


def _loopback_domain(domain_id: int) -> Any:
    """The domain of this process with the loopback configuration, shared by its participants."""
    with _domains_lock:
        domain = _domains.get(domain_id)
        if domain is None:
            domain = _domains[domain_id] = Domain(domain_id, LOOPBACK)
        return domain


def _writer_qos(qos: topics.Qos, message_type: type) -> Any:
    if qos.durability == "volatile":
        return Qos(Policy.Durability.Volatile, *_policies(qos, message_type))
    # What a late joiner gets is the durability service's history, which is 1 deep by default.
    retained = Policy.DurabilityService(0, Policy.History.KeepLast(qos.depth), -1, -1, -1)
    return Qos(Policy.Durability.TransientLocal, retained, *_policies(qos, message_type))


def _reader_qos(qos: topics.Qos, message_type: type, *, others_only: bool) -> Any:
    durability = Policy.Durability
    wanted = durability.Volatile if qos.durability == "volatile" else durability.TransientLocal
    ignored = Policy.IgnoreLocal.Participant if others_only else Policy.IgnoreLocal.Nothing
    return Qos(wanted, ignored, *_policies(qos, message_type))


def _policies(qos: topics.Qos, message_type: type) -> list[Any]:
    return [
        Policy.Reliability.Reliable(WRITE_BLOCKS_NS),
        Policy.History.KeepLast(qos.depth),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        Policy.Userdata(f"typehash={type_hash(message_type)};".encode()),
    ]
