"""What is special to DDS: the wire to another process, hostile samples, QoS as others see it."""

import gc
import os
import random
import socket
import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from cyclonedds import builtin
from cyclonedds.domain import DomainParticipant
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from hypothesis import given

from bridges.rmf import definitions as d
from bridges.rmf import graph
from bridges.rmf.dds import LOOPBACK, DdsTransport
from bridges.rmf.rihs01 import type_hash
from bridges.rmf.topics import FIRE_ALARM_TRIGGER, LIFT_REQUESTS, LIFT_STATES, VOLATILE, Topic
from bridges.rmf.transport import Publisher, TransportError
from hal_fakes.domain import free_domain
from tests.rmf import peer
from tests.rmf.conftest import Join
from tests.rmf.domains import domain_of_this_run
from tests.rmf.values import repeatable, values
from tests.waiting import wait_until

DOMAIN = domain_of_this_run()
OTHER_DOMAIN = free_domain()


@pytest.fixture(scope="module")
def echo() -> Iterator[None]:
    """A second process that sends everything back."""
    with peer.running("echo", DOMAIN):
        yield


# --- the wire --------------------------------------------------------------------------------


@pytest.mark.parametrize("topic", peer.TOPICS.values(), ids=peer.TOPICS.keys())
def test_every_message_survives_the_wire_to_another_process_and_back(
    join_dds: Join, echo: None, topic: Topic[Any]
) -> None:
    received: list[Any] = []
    node = join_dds("here")
    subscription = node.subscribe(topic.named(f"pong_{topic.name}"), received.append)
    publisher = node.publisher(topic.named(f"ping_{topic.name}"))
    wait_until(lambda: publisher.matched() and subscription.matched(), "the echo matches")

    @repeatable
    @given(values(topic.type))
    def comes_back(message: Any) -> None:
        publisher.publish(message)
        wait_until(lambda: received[-1] == message, f"{message} comes back")

    # The other process may find us later than we find it: what is sent before that is lost.
    wait_until(lambda: received or _sent(publisher, topic.type()), "a first echo comes back")
    comes_back()


def _sent(publisher: Publisher[Any], message: Any) -> bool:
    publisher.publish(message)
    return False


def test_retained_messages_reach_a_process_that_starts_later() -> None:
    ping = peer.TOPICS["EMERGENCY_SIGNAL"].named("ping_emergency_signal")
    pong = peer.TOPICS["EMERGENCY_SIGNAL"].named("pong_emergency_signal")
    received: list[d.EmergencySignal] = []
    sent = [d.EmergencySignal((str(number),), True) for number in range(130)]
    node = DdsTransport("here", OTHER_DOMAIN, loopback=True)
    try:
        publisher = node.publisher(ping)
        node.subscribe(pong, received.append)
        for message in sent:
            publisher.publish(message)
        with peer.running("echo", OTHER_DOMAIN):
            wait_until(lambda: received[-1:] == sent[-1:], "the newest comes back")
    finally:
        node.close()
    assert received == sent[30:]


def test_messages_arrive_on_the_thread_of_the_transport(join_dds: Join) -> None:
    threads: list[str] = []
    listener = join_dds("listener")
    listener.subscribe(LIFT_STATES, lambda _: threads.append(threading.current_thread().name))
    join_dds("speaker").publisher(LIFT_STATES).publish(d.LiftState())
    wait_until(lambda: threads, "the message arrives")
    assert threads == ["listener-dds"]


# --- bad input -------------------------------------------------------------------------------


def test_forged_samples_are_dropped_and_the_good_ones_after_them_arrive(
    join_dds: Join, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[d.LiftRequest] = []
    node = join_dds("listener")
    node.subscribe(LIFT_REQUESTS, received.append)
    with peer.running("hostile", DOMAIN):
        wait_until(lambda: received[-1:] == [d.LiftRequest("after")], "a good one arrives")
    names = [request.lift_name for request in received]
    assert names[names.index("Lift1") :] == ["Lift1"] + ["after"] * names.count("after")
    assert node.dropped == {"lift_requests": len(peer.COUNTED_AS_DROPPED)}
    assert [text for text in caplog.messages if "sample_dropped" in text] == [
        "sample_dropped topic=lift_requests"
        " reason=\"a string is not UTF-8: 'utf-8' codec can't decode byte 0xff in position 0:"
        ' invalid start byte" further="only counted"'
    ]


def test_noise_on_our_ports_disturbs_nobody(join_dds: Join, echo: None) -> None:
    received: list[d.LiftState] = []
    node = join_dds("here")
    node.subscribe(LIFT_STATES.named("pong_lift_states"), received.append)
    publisher = node.publisher(LIFT_STATES.named("ping_lift_states"))
    wait_until(lambda: received or _sent(publisher, d.LiftState()), "a first echo comes back")
    noise = random.Random(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(300):
            packet = b"RTPS" * noise.randint(0, 1) + noise.randbytes(noise.randint(0, 200))
            for port in (10, 11, 12, 13):  # discovery and data of the two processes in the domain
                sender.sendto(packet, ("127.0.0.1", 7400 + 250 * DOMAIN + port))
    after = d.LiftState(lift_name="after")
    publisher.publish(after)
    wait_until(lambda: received[-1] == after, "a message after the noise comes back")
    assert (publisher.matched(), node.dropped) == (1, {})


def test_a_peer_whose_qos_or_type_does_not_fit_is_named_once(
    join_dds: Join, caplog: pytest.LogCaptureFixture
) -> None:
    node = join_dds("listener")
    node.subscribe(FIRE_ALARM_TRIGGER, print)
    node.publisher(Topic("door_states", d.DoorState))
    stranger = join_dds("stranger")
    stranger.publisher(replace(FIRE_ALARM_TRIGGER, publish=VOLATILE))
    stranger.subscribe(Topic("door_states", d.LiftState), print)
    wait_until(lambda: len(caplog.messages) == 4, "each of the four ends says so")
    assert sorted(text for text in caplog.messages if "misfit" in text) == [
        'misfit topic=door_states reason="a publisher is not heard: its type does not fit ours"',
        'misfit topic=door_states reason="a subscription is not served:'
        ' its type does not fit ours"',
        'misfit topic=fire_alarm_trigger reason="a publisher is not heard:'
        ' its durability does not fit ours"',
        'misfit topic=fire_alarm_trigger reason="a subscription is not served:'
        ' its durability does not fit ours"',
    ]


def test_a_reader_thread_that_has_died_shows_at_the_next_publish(
    join_dds: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    died: list[Any] = []
    monkeypatch.setattr(threading, "excepthook", died.append)

    def broken(message: d.LiftState) -> None:
        raise ArithmeticError

    node = join_dds("broken")
    node.subscribe(LIFT_STATES, broken)
    publisher = node.publisher(LIFT_STATES)
    publisher.publish(d.LiftState())
    wait_until(lambda: died, "the thread dies")
    wait_until(lambda: _refuses(publisher), "publishing is refused")


def _refuses(publisher: Publisher[d.LiftState]) -> bool:
    try:
        publisher.publish(d.LiftState())
    except TransportError:
        return True
    return False


# --- as the others see us --------------------------------------------------------------------


@pytest.fixture
def observer() -> Iterator[Any]:
    """A participant that is none of ours, in the same process and so in the same domain."""
    keeps_the_domain = DdsTransport("keeper", DOMAIN, loopback=True)
    participant = DomainParticipant(DOMAIN)
    yield participant
    del participant
    gc.collect()
    keeps_the_domain.close()


@pytest.mark.parametrize("topic", peer.TOPICS.values(), ids=peer.TOPICS.keys())
def test_each_end_has_the_qos_the_type_and_the_type_hash_of_the_table(
    join_dds: Join, observer: Any, topic: Topic[Any]
) -> None:
    node = join_dds("observed")
    node.publisher(topic)
    node.subscribe(topic, print)
    written = _seen(observer, builtin.BuiltinTopicDcpsPublication, topic)
    read = _seen(observer, builtin.BuiltinTopicDcpsSubscription, topic)

    package = d.PACKAGES[topic.type]
    wire_type = f"{package}::msg::dds_::{topic.type.__name__}_"
    assert {written.type_name, read.type_name} == {wire_type}
    for qos in (written.qos, read.qos):
        assert qos[Policy.Reliability] == Policy.Reliability.Reliable(20_000_000)
        assert qos[Policy.DataRepresentation] == Policy.DataRepresentation(True, False)
        assert qos[Policy.Userdata].data.decode() == f"typehash={type_hash(topic.type)};"
    durability = {
        "volatile": Policy.Durability.Volatile,
        "transient_local": Policy.Durability.TransientLocal,
    }
    assert written.qos[Policy.Durability] == durability[topic.publish.durability]
    assert written.qos[Policy.History] == Policy.History.KeepLast(topic.publish.depth)
    assert read.qos[Policy.Durability] == durability[topic.subscribe.durability]
    assert read.qos[Policy.History] == Policy.History.KeepLast(topic.subscribe.depth)
    if topic.publish.durability == "transient_local":
        service = written.qos[Policy.DurabilityService]
        assert service.history == Policy.History.KeepLast(topic.publish.depth)


def _seen(observer: Any, kind: Any, topic: Topic[Any]) -> Any:
    reader = builtin.BuiltinDataReader(observer, kind)
    found: list[Any] = []

    def look() -> bool:
        found.extend(end for end in reader.take(50) if end.topic_name == f"rt/{topic.name}")
        return bool(found)

    wait_until(look, f"{topic.name} is announced")
    assert len(found) == 1
    return found[0]


def test_the_node_and_its_ends_stand_on_the_ros_graph(join_dds: Join, observer: Any) -> None:
    node = join_dds("lift_node")
    node.publisher(LIFT_STATES)
    node.subscribe(LIFT_REQUESTS, print)
    states = _seen(observer, builtin.BuiltinTopicDcpsPublication, LIFT_STATES)
    requests = _seen(observer, builtin.BuiltinTopicDcpsSubscription, LIFT_REQUESTS)
    as_ros_reads = Qos(
        Policy.Reliability.Reliable(0), Policy.Durability.TransientLocal, Policy.History.KeepAll
    )
    topic = DdsTopic(observer, "ros_discovery_info", graph.ParticipantEntitiesInfo)
    reader = DataReader(observer, topic, qos=as_ros_reads)
    announced: dict[str, tuple[bytes, Any]] = {}

    def look() -> bool:
        for info in reader.take(50):
            for entry in getattr(info, "node_entities_info_seq", []):
                announced[entry.node_name] = (bytes(info.gid.data), entry)
        return "lift_node" in announced and bool(announced["lift_node"][1].reader_gid_seq)

    wait_until(look, "the node is announced")
    participant, entry = announced["lift_node"]
    assert (entry.node_namespace, participant) == ("/", states.participant_key.bytes)
    assert [bytes(gid.data) for gid in entry.writer_gid_seq] == [states.key.bytes]
    assert [bytes(gid.data) for gid in entry.reader_gid_seq] == [requests.key.bytes]
    participants = builtin.BuiltinDataReader(observer, builtin.BuiltinTopicDcpsParticipant)
    enclaves = {one.key.bytes: one.qos[Policy.Userdata] for one in participants.take(50)}
    assert enclaves[participant].data == b"enclave=/;"


# --- opening and leaving ---------------------------------------------------------------------


def test_a_process_that_leaves_is_gone_at_once_for_the_others() -> None:
    node = DdsTransport("stays", OTHER_DOMAIN, loopback=True)
    try:
        publisher = node.publisher(LIFT_STATES.named("ping_lift_states"))
        subscription = node.subscribe(LIFT_STATES.named("pong_lift_states"), print)
        with peer.running("echo", OTHER_DOMAIN):
            wait_until(lambda: publisher.matched() and subscription.matched(), "it is found")
        # Without a farewell it would be missed only when its lease runs out, after 10 s.
        wait_until(
            lambda: not publisher.matched() and not subscription.matched(), "it is gone", 5.0
        )
    finally:
        node.close()


def test_nodes_that_come_and_go_leave_no_thread_no_file_and_no_complaint_behind(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def come_and_go() -> None:
        node = DdsTransport("guest", DOMAIN, loopback=True)
        node.subscribe(LIFT_REQUESTS, print)
        node.publisher(LIFT_STATES).publish(d.LiftState())
        node.close()

    come_and_go()
    before = _threads_and_files()
    for _ in range(10):
        come_and_go()
    wait_until(lambda: _threads_and_files() <= before, "threads and files are as before")
    assert caplog.messages == []


def _threads_and_files() -> tuple[int, int]:
    return len(os.listdir("/proc/self/task")), len(os.listdir("/proc/self/fd"))


def test_without_a_usable_network_the_error_says_what_to_look_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nowhere = LOOPBACK.replace('"lo"', '"no-such-interface"')
    monkeypatch.setenv("CYCLONEDDS_URI", nowhere)
    with pytest.raises(TransportError, match="is a network interface up, and does CYCLONEDDS_URI"):
        DdsTransport("nobody", OTHER_DOMAIN, loopback=False)


def test_on_the_subnet_cyclones_own_configuration_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    node = DdsTransport("configured", OTHER_DOMAIN, loopback=False)
    try:
        publisher = node.publisher(Topic("ping_lift_states", d.LiftState))
        with peer.running("echo", OTHER_DOMAIN):
            wait_until(lambda: publisher.matched() == 1, "a process on loopback is found")
    finally:
        node.close()


def test_a_domain_that_is_open_on_the_network_is_not_taken_for_loopback(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    exposed = DdsTransport("exposed", OTHER_DOMAIN, loopback=False)
    try:
        with pytest.raises(TransportError):
            DdsTransport("simulated", OTHER_DOMAIN, loopback=True)
    finally:
        exposed.close()
