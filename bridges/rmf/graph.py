"""Makes our endpoints a named node on the ROS graph, by the topic `ros_discovery_info`.

DDS has participants, readers and writers, but no nodes. On this topic each ROS participant publishes
which node owns which of its readers and writers, retained for late joiners. Without that
`ros2 node list` shows our endpoints under `_CREATED_BY_BARE_DDS_APP_`.
Source: ros2/rmw_dds_common, msg/*.msg, as rmw_cyclonedds and rmw_fastrtps publish them.
"""

from dataclasses import dataclass
from typing import Final

from cyclonedds.core import Entity
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import array, bounded_str, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

PACKAGE: Final = "rmw_dds_common.msg.dds_."
TYPE_HASH: Final = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e"
"""What Iron, Jazzy and later announce for ParticipantEntitiesInfo."""


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
    """The one node of a participant; published again whenever its endpoints change."""

    def __init__(self, participant: DomainParticipant, node_name: str) -> None:
        self._node = NodeEntitiesInfo("/", node_name, [], [])
        self._info = ParticipantEntitiesInfo(_gid(participant), [self._node])
        self.topic = Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo)
        self.writer = DataWriter(participant, self.topic, qos=_qos())
        self.writer.write(self._info)

    def add_reader(self, reader: DataReader) -> None:
        """Publish that this reader belongs to the node."""
        self._node.reader_gid_seq.append(_gid(reader))
        self.writer.write(self._info)

    def add_writer(self, writer: DataWriter) -> None:
        """Publish that this writer belongs to the node."""
        self._node.writer_gid_seq.append(_gid(writer))
        self.writer.write(self._info)

    def drop_writer(self, writer: DataWriter) -> None:
        """Publish that this writer has gone."""
        self._node.writer_gid_seq.remove(_gid(writer))
        self.writer.write(self._info)


def _gid(entity: Entity) -> Gid:
    return Gid(list(entity.guid.bytes))


def _qos() -> Qos:
    return Qos(
        Policy.Reliability.Reliable(100_000_000),
        Policy.Durability.TransientLocal,
        Policy.History.KeepLast(1),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
        Policy.Userdata(f"typehash={TYPE_HASH};".encode()),
    )
