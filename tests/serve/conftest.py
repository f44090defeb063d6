"""A module on the wall, with a door's YAML for it; and RMF's end of the graph."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.serve.site import Graph, Module


@pytest.fixture
def module(domain: int, tmp_path: Path) -> Iterator[Module]:
    standing = Module(tmp_path, domain)
    yield standing
    standing.close()


@pytest.fixture
def graph(module: Module) -> Iterator[Graph]:
    joined = Graph(module.domain)
    yield joined
    joined.transport.close()
