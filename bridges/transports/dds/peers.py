"""The announcements with which DDS makes ends known. An end is a publisher or a subscription. An
announcement has the topic, the type, and the type hash in its user data."""

import re
import threading
from collections.abc import Hashable
from typing import Any, Final, Protocol

from cyclonedds import builtin
from cyclonedds.core import InstanceState
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos

from bridges.transports.peers import Announced, Peers

AT_ONCE: Final = 100
HASH: Final = re.compile(r"typehash=(RIHS01_[0-9a-f]{64});")
TYPE: Final = re.compile(r"(\w+)::msg::dds_::(\w+)_")
"""The pattern of a message's name in ROS's DDS."""

_reading = threading.Lock()


class _State(Protocol):
    instance_state: int


class _End(Protocol):
    """DDS's announcement of an end (cyclonedds.builtin.DcpsEndpoint)."""

    key: Hashable
    topic_name: str
    type_name: str | None
    qos: Qos
    sample_info: _State


class BuiltinReader(builtin.BuiltinDataReader):  # type: ignore[misc] # noqa: TID251
    """A reader of announcements of participants and ends. Only one thread of the process may read at a
    time.

    cyclonedds reads the QoS of each announcement into the same variables (11.0.1, qos._CQos._gc_*). If
    two threads read at the same time, an end gets another end's user data. This can happen, because a
    process may have several nodes, each with its own thread.
    """

    def take(self, count: int) -> list[Any]:
        """Take at most `count` new announcements."""
        with _reading:
            taken: list[Any] = super().take(count)
        return taken


class DdsPeers:
    """The watcher of the topics on which DDS announces ends. It reports the ends to `peers`."""

    def __init__(self, peers: Peers) -> None:
        self._peers = peers
        self._readers: list[tuple[bool, BuiltinReader]] = []

    def join(self, participant: DomainParticipant) -> list[BuiltinReader]:
        """Make and return new readers. The caller waits for their data and deletes them."""
        topics = (builtin.BuiltinTopicDcpsSubscription, builtin.BuiltinTopicDcpsPublication)
        readers = [BuiltinReader(participant, topic) for topic in topics]
        self._readers = list(enumerate(readers))  # type: ignore[arg-type]
        self._peers.clear()
        return readers

    def look(self) -> bool:
        """Take the new announcements. Return False without new announcements."""
        news = False
        for publishes, reader in self._readers:
            while samples := reader.take(AT_ONCE):
                news = True
                for sample in samples:
                    self._take(sample, bool(publishes))
        return news

    def _take(self, sample: _End, publishes: bool) -> None:
        if sample.sample_info.instance_state != InstanceState.Alive:
            self._peers.gone(sample.key)
            return
        kind = TYPE.fullmatch(sample.type_name or "")
        if not kind or not sample.topic_name.startswith("rt/"):
            return
        topic = sample.topic_name.removeprefix("rt/")
        end = Announced(topic, f"{kind[1]}/msg/{kind[2]}", _hash(sample.qos), publishes)
        self._peers.seen(sample.key, end)


def _hash(qos: Qos) -> str:
    """Return the type hash in an end's user data. Return "" without a hash."""
    if Policy.Userdata not in qos:
        return ""
    found = HASH.search(bytes(qos[Policy.Userdata].data).decode(errors="replace"))
    return found[1] if found else ""
