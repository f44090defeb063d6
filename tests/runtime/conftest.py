"""Fixtures: an I/O module, the YAML file of a door on that module, and RMF's node."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges.system import directories
from tests.runtime.site import Graph, Module


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


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a temporary folder that stands in for the directories of services and users. The
    environment is that of a daemon to which systemd gives no directories."""
    for name in ("RUNTIME_DIRECTORY", "STATE_DIRECTORY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(directories, "SERVICE_RUN", tmp_path / "run")
    monkeypatch.setattr(directories, "SERVICE_STATE", tmp_path / "var")
    monkeypatch.setattr(directories, "USERS_RUN", tmp_path / "user")
    monkeypatch.setattr(directories, "TMP", tmp_path / "tmp")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user" / "7"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "home"))
    return tmp_path
