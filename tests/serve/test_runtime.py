import os
from pathlib import Path

import pytest

from bridges.serve.directory import (
    AlreadyRunning,
    KeptFile,
    RuntimeDirectory,
    directory,
    running_pid,
    state_file,
)


def test_a_runtime_directory_has_one_daemon_at_a_time(tmp_path: Path) -> None:
    first = RuntimeDirectory(tmp_path / "lift")
    with pytest.raises(AlreadyRunning):
        RuntimeDirectory(tmp_path / "lift")
    first.close()
    RuntimeDirectory(tmp_path / "lift").close()


def test_the_daemon_that_holds_a_directory_is_found_by_its_process_id(tmp_path: Path) -> None:
    assert running_pid(tmp_path) is None
    held = RuntimeDirectory(tmp_path)
    assert running_pid(tmp_path) == os.getpid()
    held.close()
    assert running_pid(tmp_path) is None


def test_what_is_claimed_is_remembered_until_it_is_released(tmp_path: Path) -> None:
    held = RuntimeDirectory(tmp_path)
    assert held.claimed() is None
    held.claim(b"kind: lift\n")
    held.close()
    again = RuntimeDirectory(tmp_path)
    claimed = again.claimed()
    assert claimed is not None
    assert claimed.read_bytes() == b"kind: lift\n"
    again.released()
    assert again.claimed() is None
    again.close()


def test_the_status_of_a_daemon_that_is_gone_is_not_left_behind(tmp_path: Path) -> None:
    held = RuntimeDirectory(tmp_path)
    held.write_status(b"{}")
    assert (tmp_path / "status.json").read_bytes() == b"{}"
    held.close()
    assert not (tmp_path / "status.json").exists()


def test_the_runtime_directory_is_as_given_else_systemds_else_the_users(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    file = Path("/etc/rmf-bridges/lift.yaml")
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/rmf-bridge/lift")
    assert directory(file, "/tmp/here") == Path("/tmp/here")
    assert directory(file, None) == Path("/run/rmf-bridge/lift")
    monkeypatch.delenv("RUNTIME_DIRECTORY")
    monkeypatch.setenv("XDG_RUNTIME_DIR", "/run/user/7")
    assert directory(file, None) == Path("/run/user/7/rmf-bridge/lift")
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    assert directory(file, None) == Path(f"/tmp/rmf-bridge-{os.getuid()}/rmf-bridge/lift")


def test_what_must_outlive_the_daemon_is_replaced_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "var" / "doors"))
    kept = KeptFile(state_file(Path("/etc/rmf-bridges/doors.yaml")))
    assert kept.read() is None
    kept.write(b"one")
    kept.write(b"two")
    assert kept.read() == b"two"
    assert [path.name for path in (tmp_path / "var" / "doors").iterdir()] == ["kept.json"]
    monkeypatch.delenv("STATE_DIRECTORY")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "home"))
    assert state_file(Path("doors.yaml")) == tmp_path / "home/rmf-bridge/doors/kept.json"
