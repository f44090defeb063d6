"""Properties of `dds` alone: bad input on its ports, its node in ROS's graph, and its configuration."""

import random
import socket
import threading
from collections.abc import Iterator
from contextlib import closing
from itertools import count
from typing import Any

import pytest
from cyclonedds import builtin
from cyclonedds.pub import DataWriter
from cyclonedds.pub import Publisher as DdsPublisher
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic

from bridges.messages import definitions as d
from bridges.messages.releases import DEFAULT, NEWEST
from bridges.messages.rihs01 import type_hash, type_name
from bridges.messages.topics import (
    FIRE_ALARM_TRIGGER,
    FLEET_STATES,
    LIFT_REQUESTS,
    LIFT_STATES,
    Topic,
)
from bridges.transports.cyclone import LOOPBACK
from bridges.transports.dds import discovery
from bridges.transports.dds.ends import DdsSubscription, _writer_qos
from bridges.transports.dds.idl import sample_type
from bridges.transports.dds.peers import BuiltinReader
from bridges.transports.dds.transport import DdsTransport
from bridges.transports.peers import Announced
from bridges.transports.transport import TransportError
from tests.transports import peer
from tests.transports.domains import domain_of_this_run
from tests.transports.joining import Join
from tests.transports.observing import PUBLICATION, SUBSCRIPTION, seen
from tests.waiting import wait_until


@pytest.fixture(scope="module")
def echo() -> Iterator[None]:
    """Run a second process that sends every message back."""
    with peer.running("echo", domain_of_this_run()):
        yield


# --- bad input -------------------------------------------------------------------------------


def test_noise_on_our_ports_disturbs_nobody(domain: int, join_dds: Join, echo: None) -> None:
    received: list[d.LiftState] = []
    node = join_dds("here")
    node.subscribe(LIFT_STATES.named("pong_lift_states"), received.append)
    publisher = node.publisher(LIFT_STATES.named("ping_lift_states"))
    wait_until(lambda: received or peer.sent(publisher, d.LiftState()), "a first echo comes back")
    noise = random.Random(1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(300):
            packet = b"RTPS" * noise.randint(0, 1) + noise.randbytes(noise.randint(0, 200))
            for port in (10, 11, 12, 13):  # the discovery and data ports of both processes
                sender.sendto(packet, ("127.0.0.1", 7400 + 250 * domain_of_this_run() + port))
    after = d.LiftState(lift_name="after")
    publisher.publish(after)
    wait_until(lambda: received[-1] == after, "a message after the noise comes back")
    assert (publisher.matched(), node.dropped) == (1, {})


class Unreadable(str):
    """A text that is not UTF-8 on the wire."""

    def encode(self, *_: object) -> bytes:
        return b"\xff\xfe"


def test_an_announcement_that_cannot_be_read_is_skipped_and_those_beside_it_are_not(
    join_dds: Join, observer: Any, caplog: pytest.LogCaptureFixture
) -> None:
    foreign = DdsPublisher(observer, Qos(Policy.Partition([Unreadable("lab")])))
    writers = [DataWriter(foreign, DdsTopic(observer, "anything", discovery.Gid))]
    stranger = join_dds("stranger")
    stranger.subscribe(LIFT_STATES.named("x"), print)
    stranger.publisher(Topic("door_states", d.LiftState))
    here = join_dds("here")
    here.subscribe(Topic("door_states", d.DoorState), print)
    wait_until(here.faults, "the announcement beside it is read")
    assert [code for code, _ in here.faults()] == ["TYPE_MISFIT"]
    assert (here.lives, here.dropped) == (True, {"DCPSPublication": len(writers)})
    assert not [text for text in caplog.messages if "reader_failed" in text]


def test_a_node_whose_name_cannot_be_read_costs_no_message_and_no_other_nodes_name(
    join_dds: Join, observer: Any
) -> None:
    """The foreign participant also publishes an alarm, through a writer whose QoS cannot be read."""
    nodes = DdsTopic(observer, discovery.NODES, discovery.ParticipantEntitiesInfo)
    names = DataWriter(observer, nodes, qos=discovery._qos())
    foreign = discovery.NodeEntitiesInfo("/", Unreadable("name"), [], [])
    names.write(discovery.ParticipantEntitiesInfo(discovery.Gid([1] * 16), [foreign]))
    here, heard = join_dds("here"), list[tuple[bool, str | None]]()

    def hear(alarm: d.Bool) -> None:
        sender = here.sender()
        heard.append((alarm.data, sender.node if sender else None))

    subscription = here.subscribe(FIRE_ALARM_TRIGGER, hear)
    join_dds("there").publisher(FIRE_ALARM_TRIGGER)
    wait_until(lambda: subscription.senders() == ["/there"], "the readable name is known")
    publisher = DdsPublisher(observer, Qos(Policy.Partition(["", Unreadable("lab")])))
    alarms = DdsTopic(observer, "rt/fire_alarm_trigger", sample_type(d.Bool))
    alarm = DataWriter(publisher, alarms, qos=_writer_qos(FIRE_ALARM_TRIGGER.publish, ""))
    wait_until(lambda: subscription.matched() == 2, "the foreign writer matches")
    alarm.write(sample_type(d.Bool)(d.Bool(True)))
    wait_until(lambda: heard, "the alarm is heard")
    assert heard == [(True, "")]
    assert subscription.senders() == ["/there"]


def test_a_node_keeps_its_name_however_many_have_left_the_graph_since(
    join_dds: Join, observer: Any
) -> None:
    """The foreign participant announces the nodes of 11 participants, which have left the graph."""
    subscription = join_dds("here").subscribe(FIRE_ALARM_TRIGGER, print)
    join_dds("there").publisher(FIRE_ALARM_TRIGGER)
    wait_until(lambda: subscription.senders() == ["/there"], "the first node has a name")
    nodes = DdsTopic(observer, discovery.NODES, discovery.ParticipantEntitiesInfo)
    announces = DataWriter(observer, nodes, qos=discovery._qos(100))
    alarms = DdsTopic(observer, "rt/fire_alarm_trigger", sample_type(d.Bool))
    last = DataWriter(observer, alarms, qos=_writer_qos(FIRE_ALARM_TRIGGER.publish, ""))
    some = random.Random(1)
    left = [[list(some.randbytes(16)) for _ in range(500)] for _ in range(11)]
    for guids in [*left, [list(last.guid.bytes)]]:
        owned = discovery.NodeEntitiesInfo("/", "last", [], list(map(discovery.Gid, guids)))
        announces.write(discovery.ParticipantEntitiesInfo(discovery.Gid(guids[0]), [owned]))
        subscription.senders()
    wait_until(lambda: "/last" in subscription.senders(), "the last node has a name")
    assert sorted(subscription.senders()) == ["/last", "/there"]


def test_a_node_that_has_left_reads_nobodys_name(join_dds: Join) -> None:
    """Another thread may still ask for a sender while the node deletes its readers."""
    node: Any = join_dds("here")
    node.close()
    assert node._owners([bytes(16)]) == []


def test_a_peer_with_another_type_is_named_once(
    join_dds: Join, caplog: pytest.LogCaptureFixture
) -> None:
    join_dds("listener").publisher(Topic("door_states", d.DoorState))
    join_dds("stranger").subscribe(Topic("door_states", d.LiftState), print)
    wait_until(lambda: len(caplog.messages) == 2, "both ends log the misfit")
    assert sorted(caplog.messages) == [
        'misfit topic=door_states reason="a publisher is not heard: its type does not fit ours"',
        'misfit topic=door_states reason="a subscription is not served:'
        ' its type does not fit ours"',
    ]


def test_an_end_that_is_declared_while_rmfs_release_changes_has_the_new_release(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fleet adapter appears while our node subscribes. The adapter has another release than our
    default, so the subscription must change to the adapter's release. The node's own thread makes this
    change, as always: cyclonedds crashes if one thread deletes a reader while another thread reads."""
    create, heard = (
        DdsSubscription.create,
        Announced(
            "fleet_states", type_name(d.FleetState), type_hash(d.FleetState, NEWEST), publishes=True
        ),
    )
    assert type_hash(d.FleetState, DEFAULT) != heard.hash
    adapter = DdsTransport("fleet_adapter", domain, loopback=True, release=NEWEST)
    node = DdsTransport("coordinator", domain, loopback=True)
    follow, following = node._follow_release, list[bool]()

    def follow_noted() -> None:
        following.append(True)
        follow()
        following.clear()

    with closing(adapter), closing(node):

        def found_meanwhile(*given: Any) -> Any:
            monkeypatch.undo()
            node._peers.seen("an adapter", heard)
            with monkeypatch.context() as news:
                news.setattr(node._dds_peers, "look", lambda: True)
                node._wake()
                # The node's thread must wait until `create` returns. Otherwise it soon goes on.
                wait_until(lambda: following, "the node's thread follows the release")
                threading.Event().wait(0.2)
            return create(*given)

        node._follow_release = follow_noted  # type: ignore[method-assign]
        monkeypatch.setattr(DdsSubscription, "create", found_meanwhile)
        subscription = node.subscribe(FLEET_STATES, lambda state: None)
        adapter.publisher(FLEET_STATES)
        wait_until(lambda: subscription.matched() == 1, "the adapter is heard")


# --- our node as others see it ------------------------------------------------------------------


def test_the_node_and_its_ends_stand_on_the_ros_graph(join_dds: Join, observer: Any) -> None:
    node = join_dds("lift_node")
    node.publisher(LIFT_STATES)
    node.subscribe(LIFT_REQUESTS, print)
    states = seen(observer, PUBLICATION, LIFT_STATES)
    requests = seen(observer, SUBSCRIPTION, LIFT_REQUESTS)
    as_ros_reads = Qos(
        Policy.Reliability.Reliable(0), Policy.Durability.TransientLocal, Policy.History.KeepAll
    )
    topic = DdsTopic(observer, "ros_discovery_info", discovery.ParticipantEntitiesInfo)
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
    participants = BuiltinReader(observer, builtin.BuiltinTopicDcpsParticipant)
    enclaves = {one.key.bytes: one.qos[Policy.Userdata] for one in participants.take(50)}
    assert enclaves[participant].data == b"enclave=/;"


# --- opening and leaving ---------------------------------------------------------------------


def test_without_a_usable_network_the_error_says_what_to_look_at(
    domain: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nowhere = LOOPBACK.replace('"lo"', '"no-such-interface"')
    monkeypatch.setenv("CYCLONEDDS_URI", nowhere)
    with pytest.raises(TransportError, match="is a network interface up"):
        DdsTransport("nobody", domain, loopback=False)


def test_on_the_subnet_cyclones_own_configuration_stands(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    node = DdsTransport("configured", domain, loopback=False)
    try:
        publisher = node.publisher(Topic("ping_lift_states", d.LiftState))
        with peer.running("echo", domain):
            wait_until(lambda: publisher.matched() == 1, "a process on loopback is found")
    finally:
        node.close()


def test_a_domain_that_is_open_on_the_network_is_not_taken_for_loopback(
    domain: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    exposed = DdsTransport("exposed", domain, loopback=False)
    try:
        with pytest.raises(TransportError):
            DdsTransport("simulated", domain, loopback=True)
    finally:
        exposed.close()


def test_a_publisher_that_is_withdrawn_while_the_reader_looks_for_misfits_harms_nobody(
    join_dds: Join, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[d.LiftState] = []
    node = join_dds("here")
    node.subscribe(LIFT_STATES, received.append)
    asks, withdrawn = DataWriter.get_offered_incompatible_qos_status, list[bool]()

    def look(writer: DataWriter) -> Any:
        if threading.current_thread().name == "here-dds" and not withdrawn:
            withdrawn.append(True)
            closing = threading.Thread(target=publisher.close)
            closing.start()
            closing.join()
        return asks(writer)

    publisher = node.publisher(LIFT_REQUESTS)
    monkeypatch.setattr(DataWriter, "get_offered_incompatible_qos_status", look)
    voice = join_dds("there").publisher(LIFT_STATES)
    wait_until(lambda: withdrawn, "the reader looks, because another node has come")
    after = d.LiftState(lift_name="after")
    wait_until(lambda: after in received or peer.sent(voice, after), "the node still hears")
    assert caplog.messages == []


def test_a_publisher_of_a_message_that_rmfs_release_lacks_can_be_closed(domain: int) -> None:
    node = DdsTransport("here", domain, loopback=True, release=DEFAULT)
    publisher = node.publisher(Topic("alert", d.Alert))
    assert not node.release.has(d.Alert)
    publisher.close()
    assert publisher.matched() == 0
    node.close()


def test_a_reader_that_fails_joins_again_and_hears_again(
    join_dds: Join, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    received: list[d.LiftState] = []
    node = join_dds("here")
    assert isinstance(node, DdsTransport)
    node.subscribe(LIFT_STATES, received.append)
    publisher = join_dds("there").publisher(LIFT_STATES)
    wait_until(
        lambda: received or peer.sent(publisher, d.LiftState()), "the reader hears the publisher"
    )
    whole = node._read_once
    failures = iter([MemoryError("none left")])

    def fails() -> None:
        for failure in failures:
            raise failure
        whole()

    monkeypatch.setattr(node, "_read_once", fails)
    wakes = d.LiftState(lift_name="wakes it")
    wait_until(
        lambda: any(r.exc_info for r in caplog.records) or peer.sent(publisher, wakes),
        "the reader fails",
    )
    received.clear()
    after = d.LiftState(lift_name="after")
    wait_until(
        lambda: after in received or peer.sent(publisher, after),
        "the reader joins again and hears again",
    )
    assert node.lives
    assert [r.getMessage() for r in caplog.records if r.exc_info] == [
        'reader_failed node=here reason="none left"'
    ]


@pytest.mark.parametrize("each", [1, 2], ids=["at each turn", "after each joining"])
def test_a_reader_that_keeps_failing_is_reported_as_dead(
    join_dds: Join, monkeypatch: pytest.MonkeyPatch, each: int
) -> None:
    node = join_dds("here")
    assert isinstance(node, DdsTransport)
    node.subscribe(LIFT_STATES, lambda state: None)
    publisher = join_dds("there").publisher(LIFT_STATES)

    whole, turns = node._read_once, count(1)

    def fails() -> None:
        if next(turns) % each == 0:
            raise MemoryError("none left")
        whole()

    monkeypatch.setattr("bridges.transports.dds.transport.LOOK_EVERY_S", 0.01)
    monkeypatch.setattr(node, "_read_once", fails)
    wait_until(
        lambda: peer.sent(publisher, d.LiftState()) or not node.lives,
        "the node reports itself dead",
    )
