"""Shows our endpoints as a named node on the ROS graph, through the topic `ros_discovery_info`.

DDS has participants, readers and writers, but no nodes. On this topic each ROS participant publishes
its nodes, and the readers and writers of each node. Nodes that join later receive this message too.
Without this message `ros2 node list` shows our endpoints under `_CREATED_BY_BARE_DDS_APP_`.

Source: ros2/rmw_dds_common, msg/*.msg, as rmw_cyclonedds and rmw_fastrtps publish them.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
from typing import Final

from cyclonedds.core import DDSException, Entity
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import array, bounded_str, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from bridges.transports import notices
from bridges.transports.peers import MOST

NODES: Final = "ros_discovery_info"
MOST_PARTICIPANTS: Final = 200
MOST_WRITERS: Final = 500
"""The maximum number of writers that are noted from one announcement. No participant of a site has
more."""
PACKAGE: Final = "rmw_dds_common.msg.dds_."
TYPE_HASH: Final = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"
"""The type hash of ParticipantEntitiesInfo in ROS 2 Iron, Jazzy and later."""


@annotations.final
@dataclass
class Gid(IdlStruct, typename=PACKAGE + "Gid_"):  # type: ignore[misc, call-arg]
    data: array[uint8, 16]


@annotations.final
@dataclass
class NodeEntitiesInfo(IdlStruct, typename=PACKAGE + "NodeEntitiesInfo_"):  # type: ignore[misc, call-arg]
    node_namespace: bounded_str[256]
    node_name: bounded_str[256]
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@annotations.final
@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename=PACKAGE + "ParticipantEntitiesInfo_"):  # type: ignore[misc, call-arg]
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


class NodeOnGraph:
    """The node of a DDS participant. After each change of its endpoints, the list of its endpoints is
    published again.

    `skipped`: the number of other nodes' announcements that cannot be read, by the topic's name
    """

    def __init__(
        self, participant: DomainParticipant, node_name: str, skipped: dict[str, int]
    ) -> None:
        self._skipped = skipped
        self._node = NodeEntitiesInfo("/", node_name, [], [])
        self._info = ParticipantEntitiesInfo(_gid(participant), [self._node])
        self._participant = participant
        self._owners: dict[bytes, str] = {}
        self.reader: DataReader | None = None
        self.topic = Topic(participant, NODES, ParticipantEntitiesInfo)
        self.writer = DataWriter(participant, self.topic, qos=_qos())
        self.writer.write(self._info)

    def add_reader(self, reader: DataReader) -> None:
        """Publish that the node owns this reader."""
        self._node.reader_gid_seq.append(_gid(reader))
        self.writer.write(self._info)

    def add_writer(self, writer: DataWriter) -> None:
        """Publish that the node owns this writer."""
        self._node.writer_gid_seq.append(_gid(writer))
        self.writer.write(self._info)

    def drop_writer(self, writer: DataWriter) -> None:
        """Publish that this writer has gone."""
        self._node.writer_gid_seq.remove(_gid(writer))
        self.writer.write(self._info)

    def listen(self) -> DataReader:
        """Begin to listen for the owners of writers. The last message of each participant arrives at
        once."""
        self.reader = DataReader(self._participant, self.topic, qos=_qos(MOST_PARTICIPANTS))
        return self.reader

    def owners(self, writers: Iterable[bytes], present: Callable[[], set[bytes]]) -> list[str]:
        """Return the nodes that own these writers (guids). Leave out nodes that have not announced
        themselves yet. Raises DDSException.

        `present`: returns the ends (guids) that are on the graph now, as DDS announces them
        """
        for _ in range(MOST_PARTICIPANTS):
            if not self._take_one():
                break
        if len(self._owners) > MOST:
            self._forget(present())
        return [self._owners[guid] for guid in writers if guid in self._owners]

    def _take_one(self) -> bool:
        """Take one announcement. Skip and count it if it cannot be read, because anybody can publish
        it. Return False without an announcement."""
        assert self.reader is not None
        try:
            for info in self.reader.take(1):
                if info.sample_info.valid_data:  # otherwise its participant has left
                    self._note(info)
                return True
        except DDSException:
            raise
        except Exception as error:  # noqa: BLE001 - cyclonedds raises several
            notices.skip(self._skipped, NODES, error)
            return True
        return False

    def _note(self, info: ParticipantEntitiesInfo) -> None:
        owned = (
            (bytes(gid.data), f"{node.node_namespace.rstrip('/')}/{node.node_name}")
            for node in info.node_entities_info_seq
            for gid in node.writer_gid_seq
        )
        self._owners |= dict(islice(owned, MOST_WRITERS))

    def _forget(self, present: set[bytes]) -> None:
        """Forget the writers that have left the graph. They do not say so on this topic. If too many
        are left, forget the oldest of them."""
        kept = [(guid, name) for guid, name in self._owners.items() if guid in present]
        self._owners = dict(kept[-MOST:])


def _gid(entity: Entity) -> Gid:
    return Gid(list(entity.guid.bytes))


def _qos(depth: int = 1) -> Qos:
    return Qos(
        Policy.Reliability.Reliable(100_000_000),
        Policy.Durability.TransientLocal,
        Policy.History.KeepLast(depth),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        Policy.Userdata(f"typehash={TYPE_HASH};".encode()),
    )
