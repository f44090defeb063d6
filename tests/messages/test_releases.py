"""Nodes of different RMF releases on one graph. The tests show which nodes hear each other, which
release `auto` chooses, and which faults appear."""

import logging
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest
from msgspec.structs import replace

from bridges.messages import cdr, topics
from bridges.messages import definitions as d
from bridges.messages.releases import JAZZY, KILTED, Release
from bridges.messages.rihs01 import type_hash
from bridges.runtime.outlet import Outlet
from bridges.transports.peers import Announced, Peers
from bridges.transports.transport import Transport
from tests.transports.conftest import DDS
from tests.transports.domains import domain_of_this_run
from tests.transports.joining import joining
from tests.transports.memory import MemoryNetwork, MemoryTransport
from tests.waiting import wait_until

CLEANING = d.RobotMode(9, 7, "sweeping")
FLEET = d.FleetState("fleet", (d.RobotState("robot", mode=CLEANING, battery_percent=50.0),))
JAZZYS_ROBOT = replace(FLEET.robots[0], mode=replace(CLEANING, performing_action=""))
JAZZYS_FLEET = replace(FLEET, robots=(JAZZYS_ROBOT,))
Joining = Callable[[str, Release | None], Transport]


@pytest.fixture(params=[DDS, "zenoh", "zenoh_ros2dds"])
def join_of(request: pytest.FixtureRequest) -> Iterator[Joining]:
    """Yield a function that makes a node of any release. All its nodes are on one ROS graph."""
    nodes: list[Transport] = []

    def join(name: str, release: Release | None) -> Transport:
        nodes.append(joining(request.param, domain_of_this_run(), release)(name))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()


@contextmanager
def fleet(node: Transport) -> Iterator[Callable[[], object]]:
    """Yield a function that publishes a fleet adapter's states. Tests call the function repeatedly."""
    publisher = node.publisher(topics.FLEET_STATES)
    yield lambda: publisher.publish(FLEET)
    publisher.close()


@pytest.mark.parametrize(("release", "heard"), [(JAZZY, JAZZYS_FLEET), (KILTED, FLEET)])
def test_a_message_in_the_bytes_of_a_release_is_read_by_that_release(
    release: Release, heard: d.FleetState
) -> None:
    sample = cdr.encode(d.FleetState, FLEET, release)
    assert cdr.decode(d.FleetState, sample, release) == heard
    other = KILTED if release is JAZZY else JAZZY
    with pytest.raises(cdr.CdrError):
        cdr.decode(d.FleetState, sample, other)


@pytest.mark.parametrize(("release", "heard"), [(JAZZY, JAZZYS_FLEET), (KILTED, FLEET)])
def test_auto_speaks_jazzy_until_a_fleet_adapter_shows_its_release(
    join_of: Joining, release: Release, heard: d.FleetState, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    ours, received = join_of("ours", None), list[d.FleetState]()
    ours.subscribe(topics.FLEET_STATES, received.append)
    assert (ours.release, ours.faults()) == (JAZZY, [])
    with fleet(join_of("adapter", release)) as say:
        wait_until(lambda: say() or received, "the fleet's state is heard")
    assert (ours.release, received[0], ours.faults()) == (release, heard, [])
    assert "is not heard" not in caplog.text
    assert ("release speaks=kilted" in caplog.text) == (release is KILTED)


def test_a_node_without_that_topic_follows_too(join_of: Joining) -> None:
    ours = join_of("ours", None)
    with fleet(join_of("adapter", KILTED)):
        wait_until(lambda: ours.release is KILTED, "the adapter's release is known")


def test_a_publisher_of_another_release_is_named_and_counted_while_it_is_there(
    join_of: Joining, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]
) -> None:
    ours, received = join_of("ours", JAZZY), list[d.FleetState]()
    ours.subscribe(topics.FLEET_STATES, received.append)
    fault = ("TYPE_MISFIT", "fleet_states: 1 peer(s) with another definition than ours (jazzy)")
    with fleet(join_of("adapter", KILTED)) as say:
        wait_until(lambda: ours.faults() == [fault], "the misfit is counted")
        for _ in range(20):
            say()
        reason = "a publisher is not heard: its type does not fit ours"
        wait_until(lambda: reason in caplog.text, "the misfit is named")
    wait_until(lambda: ours.faults() == [], "the adapter has left")
    assert caplog.text.count(reason) == 1
    assert received == []
    assert capfd.readouterr().err == ""


def test_two_releases_on_one_graph_are_a_fault_and_the_first_release_is_spoken(
    join_of: Joining, caplog: pytest.LogCaptureFixture
) -> None:
    ours = join_of("ours", None)
    with fleet(join_of("new", KILTED)):
        wait_until(lambda: ours.release is KILTED, "the first adapter's release is known")
        with fleet(join_of("old", JAZZY)):
            wait_until(lambda: len(ours.faults()) == 1, "the other adapter is seen")
            assert ours.faults() == [("TWO_RELEASES", "jazzy and kilted are both on this graph")]
            assert ours.release is KILTED
            what = "each of the three nodes names it"
            wait_until(lambda: caplog.text.count("two_releases") == 3, what)
        wait_until(lambda: ours.faults() == [], "the other adapter has left")
    assert caplog.text.count("two_releases") == 3


def test_many_nodes_in_one_process_read_each_other(join_of: Joining) -> None:
    watching = [join_of(f"watching_{n}", JAZZY) for n in range(6)]
    for node in watching:
        node.subscribe(topics.FLEET_STATES, lambda _: None)
    both = ("TWO_RELEASES", "jazzy and kilted are both on this graph")
    with ExitStack() as fleets:
        for n in range(1, 7):
            fleets.enter_context(fleet(join_of(f"new_{n}", KILTED)))
            fleets.enter_context(fleet(join_of(f"old_{n}", JAZZY)))
            misfits = f"fleet_states: {n} peer(s) with another definition than ours (jazzy)"
            wait_until(told(watching, [both, ("TYPE_MISFIT", misfits)]), misfits)


def told(nodes: list[Transport], faults: list[tuple[str, str]]) -> Callable[[], bool]:
    """Return a condition: each of these nodes reports these faults."""
    return lambda: all(node.faults() == faults for node in nodes)


def test_a_missing_or_unknown_hash_identifies_no_release() -> None:
    peers = Peers(None)
    peers.ours(topics.FLEET_STATES, publishes=False)
    fleet_state = "rmf_fleet_msgs/msg/FleetState"
    peers.seen(1, Announced("fleet_states", fleet_state, "", True))
    assert (peers.settle(), peers.faults()) == (False, [])
    peers.seen(2, Announced("fleet_states", fleet_state, "RIHS01_" + "0" * 64, True))
    assert (peers.settle(), peers.release) == (False, JAZZY)
    assert peers.faults() == [
        ("TYPE_MISFIT", "fleet_states: 1 peer(s) with another definition than ours (jazzy)")
    ]


def test_our_own_daemons_are_no_evidence_of_a_release() -> None:
    peers = Peers(None)
    for topic, publishes in ((topics.FLEET_STATES, False), (topics.EMERGENCY_SIGNAL, True)):
        kind = f"{d.PACKAGES[topic.type]}/msg/{topic.type.__name__}"
        peers.seen(topic.name, Announced(topic.name, kind, type_hash(topic.type), publishes))
    assert (peers.settle(), peers.release) == (False, JAZZY)


# --- messages that a release lacks ----------------------------------------------------------------


def site(release: Release) -> tuple[Outlet, MemoryTransport, list[object]]:
    """Return a node of this release, and a list that gets each alarm of the node. Another node fills
    the list."""
    network, heard = MemoryNetwork(), list[object]()
    ears = MemoryTransport(network, "ears")
    for topic in (topics.EMERGENCY_SIGNAL, topics.FIRE_ALARM_TRIGGER, topics.ALERT):
        ears.subscribe(topic, heard.append)
    node = MemoryTransport(network, "node", release)
    outlet = Outlet(node, lambda topic: topic)
    outlet.open([topics.EMERGENCY_SIGNAL, topics.ALERT])
    return outlet, node, heard


def test_without_emergency_signal_the_alarm_and_its_end_go_out_on_fire_alarm_trigger() -> None:
    outlet, node, heard = site(JAZZY)
    outlet.publish(topics.EMERGENCY_SIGNAL, d.EmergencySignal((), True))
    node.release = KILTED  # the alarm comes before the node knows its release
    outlet.publish(topics.EMERGENCY_SIGNAL, d.EmergencySignal((), False))
    assert heard == [d.Bool(True), d.Bool(False)]
    outlet, _, heard = site(KILTED)
    outlet.publish(topics.EMERGENCY_SIGNAL, d.EmergencySignal((), True))
    assert heard == [d.EmergencySignal((), True)]


def test_without_alert_the_alarm_is_a_line_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    outlet, _, heard = site(JAZZY)
    outlet.publish(topics.ALERT, d.Alert(title="a robot", message="cannot charge"))
    assert heard == []
    assert 'alert title="a robot" message="cannot charge"' in caplog.text
