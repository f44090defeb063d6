from collections.abc import Callable, Iterator

import pytest

from bridges.rmf.memory import MemoryNetwork, MemoryTransport
from bridges.rmf.transport import Transport
from tests.rmf.domains import domain_of_this_run

Join = Callable[[str], Transport]
"""Open a node of this name on the graph of this test."""


@pytest.fixture(params=["memory", "dds"])
def join(request: pytest.FixtureRequest) -> Iterator[Join]:
    """One graph for the test, on each transport in turn; its nodes leave at the end."""
    nodes: list[Transport] = []
    network = MemoryNetwork()

    def join(name: str) -> Transport:
        nodes.append(MemoryTransport(network, name) if request.param == "memory" else _dds(name))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()


@pytest.fixture
def join_dds() -> Iterator[Join]:
    """One graph for the test, on DDS."""
    nodes: list[Transport] = []

    def join(name: str) -> Transport:
        nodes.append(_dds(name))
        return nodes[-1]

    yield join
    for node in nodes:
        node.close()


def _dds(name: str) -> Transport:
    from bridges.rmf.dds import DdsTransport

    return DdsTransport(name, domain_of_this_run(), loopback=True)
