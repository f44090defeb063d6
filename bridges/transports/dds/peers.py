"""The announcements with which DDS makes ends known. An end is a publisher or a subscription. An
announcement has the topic, the type, and the type hash in its user data."""

import re
import threading
import uuid
from collections.abc import Hashable
from typing import Any, Final, Protocol

from cyclonedds import builtin
from cyclonedds.core import DDSException, InstanceState
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos

from bridges.transports import notices
from bridges.transports.peers import Announced, Peers

HASH: Final = re.compile(r"typehash=(RIHS01_[0-9a-f]{64});")
TYPE: Final = re.compile(r"(\w+)::msg::dds_::(\w+)_")
"""The pattern of a message's name in ROS's DDS."""

READING: Final = threading.Lock()
"""Whoever reads the QoS of another end holds this lock. cyclonedds reads each QoS into the same
variables (11.0.1, qos._CQos._gc_*). If two threads read at the same time, an end gets another end's
user data. This can happen, because a process may have several nodes, each with its own thread."""


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
    """A reader of announcements of participants and ends.

    Only the thread that reads may delete the reader, or another thread after the reading thread's end.
    Otherwise the process may end by a segmentation fault (11.0.1, clayer/pysertype.c: the samples that
    `take` still reads belong to the reader).
    """

    def take(self, count: int) -> list[Any]:
        """Take at most `count` new announcements."""
        with READING:
            taken: list[Any] = super().take(count)
        return taken


class DdsPeers:
    """The watcher of the topics on which DDS announces ends. It reports the ends to `peers`.

    `skipped`: the number of announcements that cannot be read, by the topic's name. Anybody can
    announce such an end, for example one whose partition is not UTF-8.
    """

    def __init__(self, peers: Peers, skipped: dict[str, int]) -> None:
        self._peers = peers
        self._skipped = skipped
        self._readers: list[tuple[bool, BuiltinReader]] = []

    def join(self, participant: DomainParticipant) -> list[BuiltinReader]:
        """Make and return new readers. The caller waits for their data and deletes them."""
        topics = (builtin.BuiltinTopicDcpsSubscription, builtin.BuiltinTopicDcpsPublication)
        readers = [BuiltinReader(participant, topic) for topic in topics]
        self._readers = list(enumerate(readers))  # type: ignore[arg-type]
        self._peers.clear()
        return readers

    def look(self) -> bool:
        """Take the new announcements. Return False without new announcements. Raises DDSException."""
        news = False
        for publishes, reader in self._readers:
            while self._take_one(reader, bool(publishes)):
                news = True
        return news

    def present(self) -> set[bytes]:
        """Return the guids of the ends of ROS's topics that are on the graph now. Any thread may call
        this method."""
        return {key.bytes for key in self._peers.present() if isinstance(key, uuid.UUID)}

    def _take_one(self, reader: BuiltinReader, publishes: bool) -> bool:
        """Take the next announcement. Return False if none is left, or if it could not be read.

        Announcements are taken one by one, because DDS gives none of several if one of them cannot be
        read."""
        try:
            samples = reader.take(1)
            for sample in samples:
                self._take(sample, publishes)
        except DDSException:
            raise
        except Exception as error:  # noqa: BLE001 - cyclonedds raises a plain Exception
            name = "DCPSPublication" if publishes else "DCPSSubscription"
            notices.skip(self._skipped, name, error)
            return False
        return bool(samples)

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
