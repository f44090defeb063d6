import gc
from collections.abc import Iterator
from typing import Any

import pytest

from bridges.transports.choose import missing_of_dds
from bridges.transports.transport import Transport
from tests.transports.domains import domain_of_this_run
from tests.transports.joining import Join, joining
from tests.transports.memory import MemoryNetwork, MemoryTransport

if missing_of_dds():
    collect_ignore = [
        "test_dds.py",
        "test_flood.py",
        "test_namesake.py",
        "test_network.py",
        "test_wires.py",
    ]

DDS = pytest.param("dds", marks=pytest.mark.dds)
ROS2 = pytest.param("ros2", marks=pytest.mark.ros)


@pytest.fixture(params=["memory", DDS, "zenoh", ROS2])
def join(request: pytest.FixtureRequest) -> Iterator[Join]:
    """Yield a function that opens nodes on one graph. The test runs on each transport in turn."""
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
    """Yield a function that opens nodes on one graph. The test runs on each transport with a wire."""
    yield from _graph(joining(request.param, domain_of_this_run()))


@pytest.fixture(params=["dds", ROS2])
def join_wire(request: pytest.FixtureRequest) -> Iterator[Join]:
    """Yield a function that opens nodes on one graph. The test runs on each transport with a DDS
    wire."""
    yield from _graph(joining(request.param, domain_of_this_run()))


@pytest.fixture
def join_dds() -> Iterator[Join]:
    """Yield a function that opens nodes on one DDS graph."""
    yield from _graph(joining("dds", domain_of_this_run()))


@pytest.fixture
def join_zenoh() -> Iterator[Join]:
    """Yield a function that opens nodes on one zenoh graph."""
    yield from _graph(joining("zenoh", domain_of_this_run()))


@pytest.fixture
def join_ros() -> Iterator[Join]:
    """Yield a function that opens nodes on one ROS graph. Only tests marked for ROS may use this
    fixture."""
    yield from _graph(joining("ros2", domain_of_this_run()))


@pytest.fixture
def observer(join_dds: Join) -> Iterator[Any]:
    """Yield a plain DDS participant in the test's process and domain. The participant uses no code of
    this project."""
    join_dds("keeps_the_domain")
    from cyclonedds.domain import DomainParticipant

    participant = DomainParticipant(domain_of_this_run())
    yield participant
    del participant
    gc.collect()


def _graph(opening: Join) -> Iterator[Join]:
    nodes: list[Transport] = []

    def join(name: str) -> Transport:
        nodes.append(opening(name))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()
