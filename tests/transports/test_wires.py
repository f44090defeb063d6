"""Requirements on transports whose wire is DDS. `ros2` needs an installed ROS (make test-ros)."""

from dataclasses import dataclass
from typing import Any

import pytest
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import float32, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic as DdsTopic

from bridges.messages import definitions as d
from bridges.messages.rihs01 import type_hash
from bridges.messages.topics import LIFT_REQUESTS, Topic
from tests.transports import golden_qos, peer
from tests.transports.domains import domain_of_this_run
from tests.transports.golden_qos import GOLDEN
from tests.transports.joining import RELEASE, Join, on_fast_dds
from tests.transports.observing import PUBLICATION, SUBSCRIPTION, seen
from tests.waiting import wait_until

ALL_TOPICS = pytest.mark.parametrize("topic", peer.TOPICS.values(), ids=peer.TOPICS.keys())


def test_forged_samples_are_dropped_and_the_good_ones_after_them_arrive(
    join_wire: Join, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[d.LiftRequest] = []
    node = join_wire("listener")
    node.subscribe(LIFT_REQUESTS, received.append)
    with peer.running("hostile", domain_of_this_run()):
        wait_until(lambda: received[-1:] == [d.LiftRequest("after")], "a good message arrives")
    names = [request.lift_name for request in received]
    assert names[names.index("Lift1") :] == ["Lift1"] + ["after"] * names.count("after")
    # cyclonedds refuses four of the samples before our code gets them. rclpy gives us all samples.
    by_us, first = {
        "DdsTransport": (4, "a string is not UTF-8: 'utf-8' codec can't decode byte 0xff"),
        "Ros2Transport": (8, "cut short: unpack_from requires a buffer of at least 24 bytes"),
    }[type(node).__name__]
    assert node.dropped == {"lift_requests": by_us}
    (told,) = [text for text in caplog.messages if "sample_dropped" in text]
    assert told.startswith(f'sample_dropped topic=lift_requests reason="{first}')


@annotations.final
@dataclass
class OtherLiftRequest(IdlStruct, typename="rmf_lift_msgs.msg.dds_.LiftRequest_"):  # type: ignore[misc, call-arg]
    """A foreign type with the name of RMF's LiftRequest and with other fields."""

    number: uint32
    lift_name: str
    height: float32


def test_a_type_of_the_same_name_with_other_fields_is_never_taken_for_ours(
    join_wire: Join, observer: Any
) -> None:
    received: list[d.LiftRequest] = []
    join_wire("listener").subscribe(LIFT_REQUESTS, received.append)
    topic = DdsTopic(observer, "rt/lift_requests", OtherLiftRequest)
    cdr = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
    stranger = DataWriter(observer, topic, qos=Qos(Policy.Reliability.Reliable(0), cdr))
    speaker = join_wire("speaker").publisher(LIFT_REQUESTS)

    def good_arrives() -> bool:
        stranger.write(OtherLiftRequest(7, "Lift1", 0.5))
        speaker.publish(d.LiftRequest("Lift1"))
        return len(received) >= 20

    wait_until(good_arrives, "the good messages arrive")
    assert set(received) == {d.LiftRequest("Lift1")}


# --- our ends as others see them ----------------------------------------------------------------


@ALL_TOPICS
def test_each_end_has_the_type_the_type_hash_and_the_qos_of_the_golden_table(
    join_wire: Join, observer: Any, topic: Topic[Any]
) -> None:
    node = join_wire("observed")
    node.publisher(topic)
    node.subscribe(topic, print)
    ends = (seen(observer, PUBLICATION, topic), seen(observer, SUBSCRIPTION, topic))
    ros_type, *golden = GOLDEN[topic.name]
    wire_type = ros_type.replace("/", "::msg::dds_::") + "_"
    assert {end.type_name for end in ends} == {wire_type}
    unannounced = node.speaks == "ros2" and on_fast_dds()
    wanted = [qos._replace(depth=1) if unannounced else qos for qos in golden]
    assert [as_ros_shows(end.qos) for end in ends] == wanted
    for end in ends:
        assert end.qos[Policy.DataRepresentation] == Policy.DataRepresentation(True, False)
        assert (
            end.qos[Policy.Userdata].data.decode() == f"typehash={type_hash(topic.type, RELEASE)};"
        )
    if golden[0].durability == "TRANSIENT_LOCAL" and not unannounced:
        kept = ends[0].qos[Policy.DurabilityService].history
        assert kept == Policy.History.KeepLast(golden[0].depth)


def as_ros_shows(qos: Any) -> golden_qos.Qos:
    """Return a DDS QoS in the form of the golden table."""
    names = {
        "Reliable": "RELIABLE",
        "Volatile": "VOLATILE",
        "TransientLocal": "TRANSIENT_LOCAL",
        "KeepLast": "KEEP_LAST",
    }
    policies = (qos[Policy.Reliability], qos[Policy.Durability], qos[Policy.History])
    reliability, durability, history = (
        names[type(policy).__name__.rpartition(".")[2]] for policy in policies
    )
    return golden_qos.Qos(reliability, durability, history, qos[Policy.History].depth)
