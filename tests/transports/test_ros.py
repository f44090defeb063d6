"""Properties of `ros2` alone: installed message packages, the graph as ROS shows it, and --ros-args."""

import importlib
import os
import subprocess
import sys
from dataclasses import dataclass
from enum import EnumType, IntEnum
from typing import Any

import pytest

from bridges.messages import definitions as d
from bridges.messages.releases import JAZZY
from bridges.messages.rihs01 import type_hash
from bridges.messages.stamps import stamp
from bridges.messages.topics import FIRE_ALARM_TRIGGER, LIFT_REQUESTS, LIFT_STATES, Topic
from bridges.transports.choose import missing_of_ros
from bridges.transports.ros2.types import fields_of
from bridges.transports.transport import TransportError
from tests.messages.test_definitions import NOT_IN_JAZZY
from tests.transports import peer
from tests.transports.conftest import ROS2
from tests.transports.domains import domain_of_this_run
from tests.transports.joining import RELEASE, Join, joining, on_fast_dds
from tests.waiting import wait_until

pytestmark = pytest.mark.ros

ALL_TOPICS = pytest.mark.parametrize("topic", peer.TOPICS.values(), ids=peer.TOPICS.keys())

ENUMS = [kind for kind in vars(d).values() if isinstance(kind, EnumType) and kind is not IntEnum]


def installed(message_type: type) -> Any:
    """Return the ROS class of one of our messages."""
    package = d.PACKAGES[message_type]
    return getattr(importlib.import_module(f"{package}.msg"), message_type.__name__)


# --- the installed packages --------------------------------------------------------------------


@pytest.mark.parametrize("message_type", RELEASE.messages(), ids=lambda kind: kind.__name__)
def test_our_table_has_the_fields_of_the_installed_package_in_their_order(
    message_type: type,
) -> None:
    theirs = installed(message_type).get_fields_and_field_types()
    assert list(fields_of(message_type, RELEASE).items()) == list(theirs.items())


@pytest.mark.parametrize("message_type", RELEASE.lacks, ids=lambda kind: kind.__name__)
def test_the_installed_package_lacks_what_its_release_lacks(message_type: type) -> None:
    package = importlib.import_module(f"{d.PACKAGES[message_type]}.msg")
    assert not hasattr(package, message_type.__name__)


@pytest.mark.parametrize("enum", ENUMS, ids=lambda enum: enum.__name__)
def test_our_table_has_the_constants_of_the_installed_package(enum: Any) -> None:
    lacking = NOT_IN_JAZZY.get(enum, set()) if RELEASE is JAZZY else set()
    ours = {name: c.value for name, c in enum.__members__.items() if name not in lacking}
    if not ours:
        return  # this release lacks the message
    message_name = enum.__doc__.partition(".")[
        0
    ]  # the docstring begins with "LiftState.door_state."
    found = installed(getattr(d, message_name))
    prefix = os.path.commonprefix(list(ours))
    public = [name for name in dir(type(found)) if name.isupper() and name[0] != "_"]
    theirs = {name: getattr(found, name) for name in public if name.startswith(prefix)}
    # A ROS `byte` is a bytes object in Python.
    assert ours == {name: v[0] if isinstance(v, bytes) else v for name, v in theirs.items()}


def test_every_enum_names_its_message() -> None:
    assert len(ENUMS) >= 7
    assert {enum.__doc__.partition(".")[0] for enum in ENUMS if enum.__doc__} <= vars(d).keys()


def test_a_package_that_is_not_installed_is_named_with_what_to_type(
    join_ros: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    @dataclass(frozen=True)
    class Thing:
        name: str = ""

    monkeypatch.setitem(d.PACKAGES, Thing, "no_such_msgs")
    topic: Topic[Any] = Topic("things", Thing)
    with pytest.raises(TransportError, match="sudo apt install ros-jazzy-no-such-msgs"):
        join_ros("node").publisher(topic)


def test_a_type_that_the_installed_package_does_not_have_is_named(
    join_ros: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    @dataclass(frozen=True)
    class Thing:
        name: str = ""

    monkeypatch.setitem(d.PACKAGES, Thing, "rmf_fleet_msgs")
    topic: Topic[Any] = Topic("things", Thing)
    with pytest.raises(TransportError, match="the installed rmf_fleet_msgs has no Thing"):
        join_ros("node").subscribe(topic, print)


def test_a_type_with_other_fields_is_refused_before_its_bytes_are_misread(
    join_ros: Join, monkeypatch: pytest.MonkeyPatch
) -> None:
    @dataclass(frozen=True)
    class DoorMode:
        value: d.int32 = 0

    @dataclass(frozen=True)
    class DoorState:
        door_time: d.Time = d.Time()
        door_name: str = ""
        current_mode: DoorMode = DoorMode()

    monkeypatch.setitem(d.PACKAGES, DoorMode, "rmf_door_msgs")
    monkeypatch.setitem(d.PACKAGES, DoorState, "rmf_door_msgs")
    topic: Topic[Any] = Topic("door_states", DoorState)
    with pytest.raises(TransportError, match="installed rmf_door_msgs/DoorMode has the fields"):
        join_ros("node").subscribe(topic, print)


# --- the graph ---------------------------------------------------------------------------------


@pytest.mark.parametrize("ours", ["dds", ROS2])
@ALL_TOPICS
def test_ros_shows_our_node_and_its_ends_with_name_qos_and_type_hash(
    join_ros: Join, ours: str, topic: Topic[Any]
) -> None:
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy

    looking: Any = join_ros("looking")
    node = joining(ours, domain_of_this_run())("lift_node")
    try:
        node.publisher(topic)
        node.subscribe(topic, print)

        def shown() -> bool:
            ends = [*_publishers(looking, topic), *_subscriptions(looking, topic)]
            return [end.node_name for end in ends] == ["lift_node", "lift_node"]

        wait_until(shown, "ROS has heard of the node's two ends")
        assert ("lift_node", "/") in looking.node.get_node_names_and_namespaces()
        for (end,), qos in (
            (_publishers(looking, topic), topic.publish),
            (_subscriptions(looking, topic), topic.subscribe),
        ):
            shown_qos = end.qos_profile
            assert end.topic_type == f"{d.PACKAGES[topic.type]}/msg/{topic.type.__name__}"
            assert str(end.topic_type_hash) == type_hash(topic.type, RELEASE)
            assert shown_qos.reliability == ReliabilityPolicy.RELIABLE
            assert shown_qos.durability == DurabilityPolicy[qos.durability.upper()]
            unknown, kept = (HistoryPolicy.UNKNOWN, 0), (HistoryPolicy.KEEP_LAST, qos.depth)
            assert (shown_qos.history, shown_qos.depth) == (unknown if on_fast_dds() else kept)
    finally:
        node.close()


def _publishers(looking: Any, topic: Topic[Any]) -> list[Any]:
    return list(looking.node.get_publishers_info_by_topic(topic.name))


def _subscriptions(looking: Any, topic: Topic[Any]) -> list[Any]:
    return list(looking.node.get_subscriptions_info_by_topic(topic.name))


@pytest.mark.parametrize(("breaks", "warns"), [("", False), ("typehash=RIHS01_", True)])
def test_ros_has_nothing_to_warn_about_when_a_dds_node_joins(
    domain: int, monkeypatch: pytest.MonkeyPatch, breaks: str, warns: bool
) -> None:
    if breaks:  # a broken type hash proves that the test would see a warning
        monkeypatch.setattr("bridges.transports.dds.ends.type_hash", lambda kind, release: "none")
    command = [sys.executable, "-m", "tests.transports.peer", "echo", str(domain), "ros2"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as ros:
        node = joining("dds", domain)("newcomer")
        received: list[d.LiftState] = []
        node.subscribe(LIFT_STATES.named("pong_lift_states"), received.append)
        publisher = node.publisher(LIFT_STATES.named("ping_lift_states"))
        wait_until(lambda: received or peer.sent(publisher, d.LiftState()), "the echo answers")
        node.close()
        _, said = ros.communicate("")
    assert bool(said) is (warns and not on_fast_dds()), said


# --- starting like a ROS node -------------------------------------------------------------------


def test_name_namespace_and_topics_are_remapped_as_for_any_ros_node(join_ros: Join) -> None:
    from bridges.transports.ros2.transport import Ros2Transport

    remapping = ["-r", "__node:=lift_a", "-r", "__ns:=/tower", "-r", "lift_states:=/all_lifts"]
    node = Ros2Transport(
        "lift_node", domain_of_this_run(), loopback=True, ros_args=["--ros-args", *remapping]
    )
    try:
        states, requests = join_ros("rmf"), join_ros("fleet")
        heard = states.subscribe(LIFT_STATES.named("all_lifts"), print)
        asked = requests.publisher(LIFT_REQUESTS.named("tower/lift_requests"))
        node.publisher(LIFT_STATES)
        node.subscribe(LIFT_REQUESTS, print)
        wait_until(lambda: heard.matched() and asked.matched(), "both are found by their new names")
        assert (node.name, node.node.get_namespace()) == ("lift_a", "/tower")
    finally:
        node.close()


@pytest.mark.parametrize(
    "ros_args", [["--ros-args", "-r"], ["--ros-args", "--no-such-flag"], ["--ros-args", "-r", "a"]]
)
def test_ros_args_that_ros_does_not_understand_are_refused(ros_args: list[str]) -> None:
    from bridges.transports.ros2.transport import Ros2Transport

    with pytest.raises(TransportError, match="cannot join ROS domain"):
        Ros2Transport("node", domain_of_this_run(), loopback=True, ros_args=ros_args)


@pytest.mark.parametrize(("given", "wanted"), [(None, "UDPv4"), ("DEFAULT", "DEFAULT")])
def test_on_fast_dds_a_node_shares_no_memory_unless_its_environment_says_so(
    monkeypatch: pytest.MonkeyPatch, given: str | None, wanted: str
) -> None:
    """RMF may run as another user. With shared memory, nodes of two users find each other, but no
    sample arrives."""
    from bridges.transports.ros2.stay import FAST_DDS_SPEAKS, Stay

    joined: list[str | None] = []
    monkeypatch.setattr(
        Stay, "_join", lambda self, *how: joined.append(os.environ.get(FAST_DDS_SPEAKS))
    )
    monkeypatch.delenv(FAST_DDS_SPEAKS, raising=False)
    if given is not None:
        monkeypatch.setenv(FAST_DDS_SPEAKS, given)
    Stay("node", domain_of_this_run(), loopback=False, ros_args=[])
    assert (joined, os.environ.get(FAST_DDS_SPEAKS)) == ([wanted], given)


def test_a_name_that_ros_does_not_allow_is_refused(join_ros: Join) -> None:
    node = join_ros("node")
    with pytest.raises(TransportError, match="topic lift states cannot be published"):
        node.publisher(LIFT_STATES.named("lift states"))
    with pytest.raises(TransportError, match="cannot join ROS domain"):
        join_ros("lift-node")


def test_stamps_follow_the_simulated_clock_where_use_sim_time_says_so(domain: int) -> None:
    from rclpy.qos import QoSProfile
    from rosgraph_msgs.msg import Clock

    from bridges.transports.ros2.transport import Ros2Transport

    simulated = ["--ros-args", "-p", "use_sim_time:=true"]
    node = Ros2Transport("node", domain, loopback=True, ros_args=simulated)
    gazebo: Any = joining("ros2", domain)("gazebo")
    try:
        assert stamp(node.wall()) == d.Time()  # no message has come on /clock
        clock = gazebo.node.create_publisher(Clock, "/clock", QoSProfile(depth=1))

        def told() -> bool:
            now = Clock()
            now.clock.sec = 1234
            clock.publish(now)
            return node.wall() == 1234.0

        wait_until(told, "the node's time is the simulated one")
    finally:
        node.close()
        gazebo.close()


def test_where_ros_is_installed_nothing_of_it_is_missing() -> None:
    assert missing_of_ros() == ""


def test_what_rclpy_converts_is_what_we_put_on_the_wire(join_ros: Join) -> None:
    looking: Any = join_ros("looking")
    received: list[Any] = []
    kind = installed(d.LiftState)
    looking.node.create_subscription(kind, "lift_states", received.append, 10)
    state = d.LiftState(d.Time(5, 6), "Lift1", ("L1", "ü"), "L1", "L2", 2, 1, (1, 2), 2, "a/b")
    publisher = join_ros("lift").publisher(LIFT_STATES)
    wait_until(lambda: received or peer.sent(publisher, state), "the converted message arrives")
    theirs = received[0]
    assert {f: _plain(getattr(theirs, f)) for f in d.LiftState.__struct_fields__} == {
        f: getattr(state, f) for f in d.LiftState.__struct_fields__
    }


def _plain(value: Any) -> Any:
    if isinstance(value, int | str):
        return value
    return d.Time(value.sec, value.nanosec) if hasattr(value, "sec") else tuple(value)


def test_a_node_that_cannot_make_a_publisher_when_it_joins_again_tries_once_more(
    domain: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    from bridges.transports.ros2.ends import Ros2Publisher

    node: Any = joining("ros2", domain)("node")
    heard: list[d.Bool] = []
    node.subscribe(FIRE_ALARM_TRIGGER, heard.append)
    alarm = node.publisher(FIRE_ALARM_TRIGGER)
    alarm.publish(d.Bool(True))
    wait_until(lambda: len(heard) == 1, "the node hears its alarm")
    create, failures = Ros2Publisher.create, iter([TransportError("refused")])

    def create_at_last(publisher: Ros2Publisher, on: Any) -> None:
        for failure in failures:
            raise failure
        create(publisher, on)

    monkeypatch.setattr(Ros2Publisher, "create", create_at_last)
    node._set_back = True
    node._wake()
    wait_until(lambda: len(heard) == 2, "the node has joined again and repeats its alarm")
    node.close()
    assert caplog.messages == ["not_joined node=node reason=refused"]
