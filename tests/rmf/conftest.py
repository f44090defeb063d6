import gc
import importlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from bridges.rmf.choose import missing_of_dds, missing_of_ros
from bridges.rmf.memory import MemoryNetwork, MemoryTransport
from bridges.rmf.releases import NEWEST, Release
from bridges.rmf.ros_types import installed
from bridges.rmf.settings import Zenoh
from bridges.rmf.transport import Transport
from bridges.rmf.zenoh import ZenohTransport
from tests.rmf.domains import domain_of_this_run

if missing_of_dds():
    collect_ignore = [
        "test_dds.py",
        "test_flood.py",
        "test_namesake.py",
        "test_network.py",
        "test_wires.py",
    ]

RELEASE = NEWEST if missing_of_ros() else installed()
"""What the tests speak: where ROS is installed, its release on every wire."""

Join = Callable[[str], Transport]
"""Open a node of this name on the graph of this test."""


ZENOH = {"zenoh": Zenoh(), "zenoh_ros2dds": Zenoh(keys="ros2dds")}
DDS = pytest.param("dds", marks=pytest.mark.dds)
ROS2 = pytest.param("ros2", marks=pytest.mark.ros)


@pytest.fixture(params=["memory", DDS, "zenoh", ROS2])
def join(request: pytest.FixtureRequest) -> Iterator[Join]:
    """One graph for the test, on each transport in turn; its nodes leave at the end."""
    network = MemoryNetwork()
    on: dict[str, Join] = {
        "memory": lambda name: MemoryTransport(network, name),
        "dds": joining("dds", domain_of_this_run()),
        "zenoh": joining("zenoh", domain_of_this_run()),
        "ros2": joining("ros2", domain_of_this_run()),
    }
    yield from _graph(on[request.param])


@pytest.fixture(params=[DDS, "zenoh", ROS2])
def join_any_wire(request: pytest.FixtureRequest) -> Iterator[Join]:
    """One graph for the test, on each transport that has a wire."""
    yield from _graph(joining(request.param, domain_of_this_run()))


@pytest.fixture(params=["dds", ROS2])
def join_wire(request: pytest.FixtureRequest) -> Iterator[Join]:
    """One graph for the test, on each transport whose wire is DDS."""
    yield from _graph(joining(request.param, domain_of_this_run()))


@pytest.fixture
def join_dds() -> Iterator[Join]:
    """One graph for the test, on DDS."""
    yield from _graph(joining("dds", domain_of_this_run()))


@pytest.fixture
def join_zenoh() -> Iterator[Join]:
    """One graph for the test, on zenoh."""
    yield from _graph(joining("zenoh", domain_of_this_run()))


@pytest.fixture
def join_ros() -> Iterator[Join]:
    """One graph for the test, on ROS; for tests that are marked so."""
    yield from _graph(joining("ros2", domain_of_this_run()))


@pytest.fixture
def observer(join_dds: Join) -> Iterator[Any]:
    """A participant that is none of ours, in the same process and so in the same domain."""
    join_dds("keeps_the_domain")
    from cyclonedds.domain import DomainParticipant

    participant = DomainParticipant(domain_of_this_run())
    yield participant
    del participant
    gc.collect()


def joining(transport: str, domain: int, release: Release | None = RELEASE) -> Join:
    """What opens nodes of this transport in this domain, on loopback."""

    def join(name: str) -> Transport:
        if transport.startswith("zenoh"):
            ways = ZENOH[transport]
            return ZenohTransport(name, domain, loopback=True, settings=ways, release=release)
        # Imported here: there may be no ROS.
        module = importlib.import_module(f"bridges.rmf.{transport}")
        kind = {"dds": "DdsTransport", "ros2": "Ros2Transport"}[transport]
        wanted = {} if transport == "ros2" else {"release": release}  # that takes what is installed
        node: Transport = getattr(module, kind)(name, domain, loopback=True, **wanted)
        return node

    return join


def _graph(opening: Join) -> Iterator[Join]:
    nodes: list[Transport] = []

    def join(name: str) -> Transport:
        nodes.append(opening(name))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()
