"""The `dds` transport. It speaks as a ROS 2 node through cyclonedds 11.0.1, and needs no ROS.

Names, types and QoS are those of rmw_cyclonedds and rmw_fastrtps. The topic is `rt/<name>`, and the
type is `<package>::msg::dds_::<Type>_`. The encoding is plain CDR. The endpoint's user data hold the
type hash.

One thread reads for all subscriptions. The thread drops and counts invalid samples, and logs the first
invalid sample of each topic. Cyclone's C library refuses samples that do not fit their type, and logs
them on stderr. If reading fails, the node joins again.

Only this folder imports cyclonedds, and only `choose.py` imports this file.
"""

import ctypes
import logging
import os
import threading
import time
from collections.abc import Callable
from typing import Final, TypeVar
from weakref import WeakValueDictionary

from cyclonedds import core
from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.internal import DDS, dds_infinity
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic as DdsTopic

from bridges.messages.releases import Release
from bridges.messages.topics import AnyTopic, Topic
from bridges.system.log import pairs
from bridges.transports import addresses, cyclone, notices
from bridges.transports.dds.discovery import NodeOnGraph
from bridges.transports.dds.ends import DdsPublisher, DdsSubscription
from bridges.transports.dds.idl import sample_type
from bridges.transports.dds.peers import DdsPeers
from bridges.transports.threaded import LOOK_EVERY_S, Threaded
from bridges.transports.transport import M, TransportError, any_type

log = logging.getLogger(__name__)

E = TypeVar("E", bound=core.Entity)

CANNOT_JOIN: Final = (
    "is a network interface up? Does CYCLONEDDS_URI, if set, name an interface that exists? Is the "
    "clock after 1970? `network: localhost` needs no network. Cannot join DDS domain"
)
LOOK_EVERY_NS: Final = int(LOOK_EVERY_S * 1e9)
ANY_SAMPLE: Final = core.SampleState.Any | core.ViewState.Any | core.InstanceState.Any
ERRORS: Final = 1 | 2
"""The categories of messages that Cyclone may log, which are errors and fatal errors. Warnings are left
out, because anybody can send malformed datagrams, and Cyclone would log a warning for each. Neither
its Python binding nor its configuration can turn warnings off."""

_domains: WeakValueDictionary[tuple[int, str], Domain] = WeakValueDictionary()
_domains_lock = threading.Lock()


class DdsTransport(Threaded):
    """One node: a participant, its reader thread, its publishers and its subscriptions.

    `loopback`: stay on this machine, even if CYCLONEDDS_URI says otherwise. `release`: the RMF release
    whose messages the node uses, or None to use the release of RMF's own nodes. Raises TransportError
    if the node cannot join the domain.

    The node joins the graph again when the wall clock is set back. Without `loopback` it also joins
    again when the machine's addresses change. The caller keeps its publishers and subscriptions.
    Publishers repeat the retained messages that still hold (`Topic.repeats`).
    """

    speaks = "dds"

    refusals = (DDSException,)

    def __init__(
        self, node_name: str, domain_id: int, *, loopback: bool, release: Release | None = None
    ) -> None:
        super().__init__(node_name, domain_id, release)
        self._failed = False
        self._entities: list[core.Entity] = []
        self._topics: dict[str, DdsTopic] = {}
        self._ends: tuple[DdsPublisher | DdsSubscription, ...] = ()
        self._subscriptions: tuple[DdsSubscription, ...] = ()
        self._loopback = loopback
        self._joined = False
        self._dds_peers = DdsPeers(self._peers, self.dropped)
        try:
            with self._reporting(f"{CANNOT_JOIN} {domain_id}"):
                self._join()
        except TransportError:
            self._delete_entities()
            raise
        self._start(self._read, "dds")
        self._watch_clock()

    def publisher(self, topic: AnyTopic) -> DdsPublisher:
        """Declare a publisher with `topic.publish` QoS."""
        publisher = DdsPublisher(topic, self._thread, self._withdraw)
        with self._lock, self._reporting(f"topic {topic.name} cannot be published"):
            if self._joined:
                self._attach(publisher)
            self._ends += (publisher,)
        return publisher

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> DdsSubscription:
        """Declare a subscription with `topic.subscribe` QoS. The transport's thread calls
        `received`."""
        subscription = DdsSubscription(
            topic,
            any_type(received),
            self.dropped,
            self._owners,
            self._senders,
            others_only=others_only,
        )
        with self._lock, self._reporting(f"topic {topic.name} cannot be subscribed"):
            if self._joined:
                self._attach(subscription)
            self._ends += (subscription,)
            self._subscriptions += (subscription,)
        return subscription

    def close(self) -> None:
        """Leave the graph at once. Delete each DDS entity now, because the garbage collector may delete
        it much later."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            self._stop.set()
            self._wake()
        self._join_thread()
        self._delete_entities()

    def _wake(self) -> None:
        if self._joined:
            self._leaving.set(True)

    def _join(self) -> None:
        self._addresses = addresses.addresses()
        wanted = cyclone.LOOPBACK if self._loopback else cyclone.configuration(os.environ)
        self._domain = _shared_domain(self.domain_id, wanted)
        userdata = Qos(Policy.Userdata(b"enclave=/;"))
        self._participant = self._keep(DomainParticipant(self.domain_id, qos=userdata))
        self._waitset = self._keep(core.WaitSet(self._participant))
        self._leaving = self._keep(core.GuardCondition(self._participant))
        self._waitset.attach(self._leaving)
        for reader in self._dds_peers.join(self._participant):
            self._waitset.attach(self._keep(core.ReadCondition(self._keep(reader), ANY_SAMPLE)))
        self._node = NodeOnGraph(self._participant, self.name, self.dropped)
        self._entities += [self._node.topic, self._node.writer]
        self._joined = True

    def _follow_network(self) -> None:
        """Join again if the machine's addresses have changed, or if the last attempt failed."""
        if (self._loopback and self._joined) or not self._look_is_due():
            return
        if self._network_changed() or not self._joined:
            self._join_anew()

    def _join_anew(self) -> None:
        with self._lock:
            if self._closed:
                return
            was_joined, self._joined, self._set_back = self._joined, False, False
            self._delete_entities()
            self._topics.clear()
            try:
                self._join()
                for end in self._ends:
                    self._attach(end)
            except DDSException as error:
                self._joined = False
                self._delete_entities()
                if was_joined:
                    log.warning(pairs("not_joined", node=self.name, reason=error))

    def _topic(self, topic: AnyTopic) -> DdsTopic:
        name = f"rt/{topic.name}"
        if name not in self._topics:
            kind = sample_type(topic.type, self.release)
            self._topics[name] = self._keep(DdsTopic(self._participant, name, kind))
        return self._topics[name]

    def _attach(self, end: DdsPublisher | DdsSubscription) -> None:
        """Make the DDS entities of an end. Make none if the present release lacks the end's message."""
        self._peers.ours(end.topic, publishes=isinstance(end, DdsPublisher))
        if not self.release.has(end.topic.type):
            end.drop()
            return
        entity = self._keep(end.create(self._participant, self._topic(end.topic), self.release))
        entity.set_status_mask(end.watched)
        self._waitset.attach(entity)
        if isinstance(end, DdsPublisher):
            self._node.add_writer(entity)
            end.begin(entity, self.release)
        else:
            self._waitset.attach(self._keep(core.ReadCondition(entity, ANY_SAMPLE)))
            self._node.add_reader(entity)

    def _read(self) -> None:
        failures = notices.Failures()
        while not self._closed and not failures.too_many:
            try:
                self._read_once()
            except Exception as error:  # noqa: BLE001 - logged by _recover
                failures.count(time.monotonic())
                self._recover(error)

    def _read_once(self) -> None:
        if self._set_back:
            self._join_anew()
        self._follow_network()
        if not self._joined:
            self._stop.wait(LOOK_EVERY_S)
            return
        self._waitset.wait(dds_infinity if self._loopback else LOOK_EVERY_NS)
        if self._dds_peers.look():
            self._follow_release()
        taken = [subscription.take() for subscription in self._subscriptions]
        if not any(taken):
            for end in self._ends:
                end.log_misfits(self._peers)

    def _follow_release(self) -> None:
        """Adopt RMF's release. Join again if one of our messages differs in this release.

        Meanwhile the lock keeps other threads from declaring a publisher or subscription. Otherwise it
        would keep the message type of the earlier release.
        """
        with self._lock:
            before, changed = self.release, self._peers.settle()
            stale = changed and any(self._peers.differs(e.topic, before) for e in self._ends)
        if stale:
            self._join_anew()
        else:
            self._peers.name_misfits()

    def _recover(self, error: Exception) -> None:
        """Recover from an unexpected exception. Log only the first exception, and join again after a
        pause."""
        if self._closed:
            return
        if not self._failed:
            log.error(pairs("reader_failed", node=self.name, reason=error), exc_info=error)
        self._failed = True
        self._stop.wait(LOOK_EVERY_S)
        self._join_anew()

    def _owners(self, writers: list[bytes]) -> list[str]:
        with self._lock:
            if self._closed or not self._joined:
                return []
            if self._node.reader is None:
                self._keep(self._node.listen())
            return self._node.owners(writers, self._dds_peers.present)

    def _withdraw(self, publisher: DdsPublisher) -> None:
        """Take one writer off the graph. Do nothing after `close`, which removes all writers."""
        with self._lock:
            if self._closed or publisher not in self._ends:
                return
            self._ends = tuple(end for end in self._ends if end is not publisher)
            writer = publisher.drop()
            if not self._joined or writer is None:
                return
            self._waitset.detach(writer)
            self._node.drop_writer(writer)
            self._entities = [entity for entity in self._entities if entity is not writer]
            writer.__del__()

    def _keep(self, entity: E) -> E:
        self._entities.append(entity)
        return entity

    def _delete_entities(self) -> None:
        while self._entities:
            self._entities.pop().__del__()  # deletes the C entity; a second call does nothing
        self._domain = None


def _shared_domain(domain_id: int, configuration: str) -> Domain:
    """Return the domain object of this process for this configuration. All participants share the
    object, because a process can open a domain only once."""
    key = domain_id, configuration
    with _domains_lock:
        domain = _domains.get(key)
        if domain is None:
            DDS._dll_handle.dds_set_log_mask(ctypes.c_uint32(ERRORS))
            domain = _domains[key] = Domain(domain_id, configuration)
        return domain
