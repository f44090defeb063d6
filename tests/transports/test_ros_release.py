"""The release of RMF that `ros2` finds in installed packages or on ROS's graph.

A stand-in replaces ROS.
"""

import sys
from dataclasses import dataclass, field
from types import ModuleType

import pytest

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.releases import JAZZY, KILTED, RELEASES, Release
from bridges.messages.rihs01 import type_hash
from bridges.messages.topics import AnyTopic
from bridges.transports.peers import Peers
from bridges.transports.ros2 import peers as ros_peers
from bridges.transports.ros2.types import fields_of, installed, ros_type
from bridges.transports.transport import TransportError


def install(release: Release, monkeypatch: pytest.MonkeyPatch) -> None:
    """Install stand-ins for the ROS packages of a release."""
    for package in set(d.PACKAGES.values()):
        module = ModuleType(f"{package}.msg")
        for kind in (k for k in release.messages() if d.PACKAGES[k] == package):
            fields = fields_of(kind, release)
            made = type(kind.__name__, (), {"get_fields_and_field_types": lambda f=fields: dict(f)})
            setattr(module, kind.__name__, made)
        monkeypatch.setitem(sys.modules, package, ModuleType(package))
        monkeypatch.setitem(sys.modules, f"{package}.msg", module)


@pytest.mark.parametrize("release", RELEASES.values(), ids=RELEASES.keys())
def test_the_release_is_that_of_the_installed_packages(
    release: Release, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(release, monkeypatch)
    assert installed() is release
    for kind in release.messages():
        assert ros_type(kind, release).__name__ == kind.__name__


def test_a_message_that_the_release_lacks_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    install(JAZZY, monkeypatch)
    with pytest.raises(TransportError, match="the installed rmf_fleet_msgs has no EmergencySignal"):
        ros_type(d.EmergencySignal, JAZZY)


@dataclass
class Info:
    """A stand-in for rclpy's TopicEndpointInfo, with only the parts that our code reads."""

    topic_type: str
    topic_type_hash: object
    endpoint_gid: list[int] = field(default_factory=lambda: [1] * 16)


class Graph:
    """A stand-in for an rclpy node that sees exactly one publisher of fleet_states."""

    def __init__(self, hashed: str) -> None:
        self.infos = [Info("rmf_fleet_msgs/msg/FleetState", hashed)]

    def get_publishers_info_by_topic(self, topic_name: str) -> list[Info]:
        return self.infos if topic_name == "fleet_states" else []

    def get_subscriptions_info_by_topic(self, topic_name: str) -> list[Info]:
        return []


@pytest.mark.parametrize(
    ("hashed", "fits"),
    [
        (type_hash(d.FleetState, JAZZY), True),
        (type_hash(d.FleetState, KILTED), False),
        ("INVALID", True),
    ],
)
def test_a_peer_whose_type_does_not_fit_is_counted_on_ros_too(
    hashed: str, fits: bool, caplog: pytest.LogCaptureFixture
) -> None:
    peers = Peers(JAZZY)
    ours: list[tuple[AnyTopic, bool]] = [(topics.FLEET_STATES, False), (topics.LIFT_STATES, True)]
    for _ in range(3):
        ros_peers.look(Graph(hashed), peers, ours)
    fault = ("TYPE_MISFIT", "fleet_states: 1 peer(s) with another definition than ours (jazzy)")
    assert peers.faults() == ([] if fits else [fault])
    assert caplog.text.count("misfit topic=fleet_states") == (not fits)
