"""The files in a daemon's directories, and the rule by which a daemon finds its directories."""

import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from bridges.runtime import runtime_directory
from bridges.runtime.holder import HOLDER, LockHolder, look, ourselves
from bridges.runtime.record import ClaimRecord
from bridges.runtime.runtime_directory import (
    LOCK,
    AlreadyRunning,
    MemoryFile,
    RuntimeDirectory,
    find,
    state_file,
)
from bridges.system.directories import Directories
from tests.depth import depth

FILE = Path("/etc/rmf-bridges/lift.yaml")
OURS = ourselves(FILE, serves=True)
DEAD = replace(OURS, started=1)
"""The identity of a dead process. A new process has got the dead process's number."""
CLAIMED = ClaimRecord(str(FILE), b"kind: lift\n", {"make.yaml": b"for: door_register\n"})


def in_one(path: Path) -> Directories:
    return Directories(path, path)


def named(folder: Path, holder: LockHolder) -> None:
    (folder / HOLDER).write_bytes(msgspec.json.encode(holder))


def held(path: Path, *, serves: bool = True, file: Path = FILE) -> RuntimeDirectory:
    return RuntimeDirectory(in_one(path), file, serves=serves, wait_s=0.0)


def test_a_runtime_directory_has_one_daemon_at_a_time(tmp_path: Path) -> None:
    first = held(tmp_path / "lift")
    said = (
        rf"^{Path(FILE).name} is already running: process {os.getpid()}, for {FILE};"
        rf" rmf-bridge status shows it\..* kill {os.getpid()}$"
    )
    with pytest.raises(AlreadyRunning, match=said):
        held(tmp_path / "lift")
    first.close()
    held(tmp_path / "lift").close()


def test_the_daemon_that_holds_a_directory_is_found_with_what_it_serves(tmp_path: Path) -> None:
    there = in_one(tmp_path)
    assert look(there) is None
    serving = held(tmp_path)
    assert look(there) == OURS
    serving.close()
    assert look(there) is None


def test_its_name_in_either_directory_shows_that_a_daemon_lives(tmp_path: Path) -> None:
    both = Directories(tmp_path / "run", tmp_path / "state")
    serving = RuntimeDirectory(both, FILE, serves=True)
    for path in (tmp_path / "run" / HOLDER, tmp_path / "state" / HOLDER):
        path.rename(path.with_name("away"))
        assert look(both) == OURS
        path.with_name("away").rename(path)
    serving.close()


def test_where_the_state_keeps_an_old_name_the_runtime_directory_says_who_it_is(
    tmp_path: Path,
) -> None:
    both = Directories(tmp_path / "run", tmp_path / "state")
    serving = RuntimeDirectory(both, FILE, serves=False)
    named(
        tmp_path / "state", DEAD
    )  # an earlier daemon wrote this file before the disk became read-only
    assert look(both) == replace(OURS, serves=False)
    with pytest.raises(AlreadyRunning, match=f"in use by process {os.getpid()}"):
        RuntimeDirectory(both, FILE, serves=True, wait_s=0.0)
    (tmp_path / "run" / HOLDER).write_bytes(b"")
    assert look(both) is None
    with pytest.raises(AlreadyRunning, match="by an unnamed program"):
        RuntimeDirectory(both, FILE, serves=True, wait_s=0.0)
    serving.close()
    assert look(both) is None


def test_what_is_claimed_is_remembered_whole_until_it_is_released(tmp_path: Path) -> None:
    first = held(tmp_path)
    assert first.records.unreleased() == []
    first.claim(CLAIMED)
    first.close()
    again = held(tmp_path)
    assert again.records.unreleased() == [CLAIMED]
    again.claim(CLAIMED)
    again.released()
    assert again.records.unreleased() == []
    again.close()


def test_a_daemon_on_another_yaml_overwrites_no_unreleased_claim(tmp_path: Path) -> None:
    first = held(tmp_path)
    first.claim(CLAIMED)
    first.close()
    edited = ClaimRecord(str(FILE), b"kind: door\n", {})
    second = held(tmp_path)
    second.claim(edited)
    assert sorted(r.yaml for r in second.records.unreleased()) == [b"kind: door\n", b"kind: lift\n"]
    second.released()
    assert second.records.unreleased() == [CLAIMED]
    second.close()


def test_a_record_of_another_file_with_the_same_directory_counts_too(tmp_path: Path) -> None:
    first = held(tmp_path)
    first.claim(CLAIMED)
    first.close()
    other = held(tmp_path, file=Path("/home/pi/lift.yaml"))
    assert other.records.unreleased() == [CLAIMED]
    other.close()


def test_a_record_goes_where_it_survives_a_power_cut_and_elsewhere_only_if_that_is_full(
    tmp_path: Path,
) -> None:
    both = Directories(tmp_path / "run", tmp_path / "state")
    serving = RuntimeDirectory(both, FILE, serves=True)
    in_the_way = tmp_path / "state" / f".{CLAIMED.name}.new"
    in_the_way.mkdir()
    serving.claim(CLAIMED)
    assert [p.parent.name for p in tmp_path.rglob("claimed-*")] == ["run"]
    in_the_way.rmdir()
    serving.write_status(b"{}")
    assert (tmp_path / "state" / CLAIMED.name).exists()
    serving.released()
    assert list(tmp_path.rglob("claimed-*")) == []
    serving.close()


def test_the_status_of_a_daemon_that_is_gone_is_not_left_behind(tmp_path: Path) -> None:
    serving = held(tmp_path)
    serving.write_status(b"{}")
    assert (tmp_path / "status.json").read_bytes() == b"{}"
    serving.close()
    assert not (tmp_path / "status.json").exists()


def test_a_failed_write_is_logged_once_and_tried_again_until_it_works(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    serving = held(tmp_path)
    (tmp_path / ".status.json.new").mkdir()
    for _ in range(3):
        serving.write_status(b"{}")
    (tmp_path / ".status.json.new").rmdir()
    serving.write_status(b"{}")
    serving.write_status(b"{}")
    serving.close()
    said = [message.split(" reason")[0] for message in caplog.messages]
    assert said == ["not_written what=status.json", "written_again what=status.json"]


def test_a_directory_that_was_removed_is_made_again_with_its_lock_and_its_record(
    tmp_path: Path,
) -> None:
    serving = held(tmp_path / "run")
    serving.claim(CLAIMED)
    for path in (tmp_path / "run").iterdir():
        path.unlink()
    (tmp_path / "run").rmdir()
    serving.write_status(b"{}")
    assert look(in_one(tmp_path / "run")) == OURS
    assert serving.records.unreleased() == [CLAIMED]
    serving.close()


def test_a_start_waits_while_outputs_are_being_switched_off(tmp_path: Path) -> None:
    text = (
        "import sys; from pathlib import Path; from bridges.runtime.runtime_directory import *;"
        "from bridges.system.directories import Directories; p = Path(sys.argv[1]);"
        "d = RuntimeDirectory(Directories(p, p), Path('x'), serves=False);"
        "print('held', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", text, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout
        assert other.stdout.readline() == b"held\n"
        with pytest.raises(AlreadyRunning):
            held(tmp_path)
        assert other.stdin
        other.stdin.close()
        RuntimeDirectory(in_one(tmp_path), FILE, serves=True, wait_s=20.0).close()


def test_the_runtime_directory_is_the_given_one_or_systemds_or_the_services_or_the_users(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    by_hand = Directories(machine / "user/7/rmf-bridge/lift", machine / "home/rmf-bridge/lift")
    service = Directories(machine / "run/lift", machine / "var/lift")
    assert find(FILE, None) == by_hand
    RuntimeDirectory(service, FILE, serves=True).close()
    assert find(FILE, None) == service
    assert find(Path("/home/pi/lift.yaml"), None) == by_hand
    monkeypatch.setenv("RUNTIME_DIRECTORY", "/run/rmf-bridge/lift")
    assert find(FILE, None) == in_one(Path("/run/rmf-bridge/lift"))
    monkeypatch.setenv("STATE_DIRECTORY", "/var/lib/rmf-bridge/lift")
    assert find(FILE, None).state == Path("/var/lib/rmf-bridge/lift")
    assert find(FILE, "/tmp/here") == in_one(Path("/tmp/here"))


def test_a_link_in_the_folder_of_services_that_was_moved_still_finds_the_service(
    machine: Path,
) -> None:
    """A site's release is a link that moves: /etc/rmf-bridges/lift.yaml leads to 41/lift.yaml, and then
    to 42/lift.yaml."""
    service = Directories(machine / "run/lift", machine / "var/lift")
    serving = RuntimeDirectory(service, machine / "41" / "lift.yaml", serves=True)
    assert find(FILE, None) == service
    assert find(machine / "42" / "lift.yaml", None) != service
    with pytest.raises(AlreadyRunning, match="is already running: process"):
        runtime_directory.held(FILE, None, serves=True)
    serving.close()


def test_a_daemon_by_hand_of_a_services_file_keeps_the_service_from_starting(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    service = Directories(machine / "run/lift", machine / "var/lift")
    for folder in service.folders:
        folder.mkdir(mode=0o700, parents=True)
    by_hand = runtime_directory.held(FILE, None, serves=True)
    monkeypatch.setenv("RUNTIME_DIRECTORY", str(service.runtime))
    monkeypatch.setenv("STATE_DIRECTORY", str(service.state))
    with pytest.raises(AlreadyRunning):
        runtime_directory.held(FILE, None, serves=True)
    by_hand.close()


def test_after_a_power_cut_only_the_record_shows_the_service(machine: Path) -> None:
    service = Directories(machine / "run/lift", machine / "var/lift")
    serving = RuntimeDirectory(service, FILE, serves=True)
    serving.claim(CLAIMED)
    serving.close()
    for path in (machine / "run/lift").iterdir():
        path.unlink()
    (machine / "var/lift" / HOLDER).unlink()
    assert find(FILE, None) == service


def test_root_by_sudo_finds_the_daemon_that_this_user_has_started_by_hand(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runtime = machine / "user" / str(os.getuid()) / "rmf-bridge" / "lift"
    RuntimeDirectory(in_one(runtime), FILE, serves=True).close()
    assert find(FILE, None).runtime == machine / "user/7/rmf-bridge/lift"
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setenv("SUDO_UID", str(os.getuid()))
    assert find(FILE, None).runtime == runtime
    monkeypatch.setenv("SUDO_UID", "65534")
    assert find(FILE, None).runtime == machine / "user/7/rmf-bridge/lift"


def test_without_xdg_a_daemon_by_hand_is_below_tmp(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    assert find(FILE, None).runtime == machine / f"tmp/rmf-bridge-{os.getuid()}/rmf-bridge/lift"


def test_a_name_that_is_a_symbolic_link_cannot_be_seen_and_nonsense_says_nothing(
    tmp_path: Path,
) -> None:
    (tmp_path / HOLDER).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(PermissionError, match="cannot see whether"):
        look(in_one(tmp_path))
    (tmp_path / HOLDER).unlink()
    for told in ('{"pid": "all", "file": 1}', f'{{"pid": {10**30}, "file": "x"}}', "[]", ""):
        (tmp_path / HOLDER).write_text(told)
        assert look(in_one(tmp_path)) is None


@pytest.mark.parametrize(
    "dead",
    [
        replace(OURS, started=1),
        replace(OURS, boot="another"),
        replace(OURS, pid=0),
        replace(OURS, pid=-1),
        replace(OURS, pid=2**22 + 1),
    ],
)
def test_a_number_that_another_process_has_by_now_is_no_holder(
    tmp_path: Path, dead: LockHolder
) -> None:
    named(tmp_path, dead)
    assert look(in_one(tmp_path)) is None
    held(tmp_path).close()


def test_a_daemon_that_has_not_been_reaped_yet_does_not_live(tmp_path: Path) -> None:
    with subprocess.Popen(["sleep", "60"]) as other:
        started = int(Path(f"/proc/{other.pid}/stat").read_text().rpartition(")")[2].split()[19])
        named(tmp_path, replace(OURS, pid=other.pid, started=started))
        before = look(in_one(tmp_path))
        other.kill()
        os.waitid(os.P_PID, other.pid, os.WEXITED | os.WNOWAIT)
        assert (before is not None, look(in_one(tmp_path))) == (True, None)


def test_a_daemon_whose_version_has_another_lock_is_known_by_its_fresh_status(
    tmp_path: Path,
) -> None:
    told = tmp_path / "status.json"
    with subprocess.Popen(["sleep", "60"]) as other:
        told.write_text(json.dumps({"pid": other.pid, "file": str(FILE)}))
        assert look(in_one(tmp_path)) == LockHolder(other.pid, str(FILE), True)
        with pytest.raises(AlreadyRunning, match=f"already running: process {other.pid}"):
            held(tmp_path)
        assert told.exists(), "another daemon's status file was removed"
        written_at = told.stat().st_mtime
        os.utime(told, (written_at - 6, written_at - 6))
        assert look(in_one(tmp_path)) is None
        os.utime(told)
        other.kill()
    held(tmp_path).close()


def test_a_dead_daemon_whose_pid_is_in_use_again_does_not_stop_a_start(tmp_path: Path) -> None:
    """A container starts again at once, and gives the same pids."""
    told = tmp_path / "status.json"
    told.write_text(json.dumps({"pid": os.getpid(), "file": str(FILE)}))
    held(tmp_path).close()
    with subprocess.Popen(["sleep", "60"]) as other:
        of_dead = {"pid": other.pid, "file": str(FILE), "boot": OURS.boot, "started": 1}
        told.write_text(json.dumps(of_dead))
        held(tmp_path).close()
        other.kill()


def test_only_its_user_can_open_the_lock_and_its_group_can_read_who_holds_it(
    tmp_path: Path,
) -> None:
    serving = held(tmp_path / "run")
    modes = {path.name: path.stat().st_mode & 0o777 for path in (tmp_path / "run").iterdir()}
    serving.close()
    assert modes == {LOCK: 0o600, HOLDER: 0o640}


def test_a_daemon_that_is_refused_leaves_the_other_ones_files_as_they_are(tmp_path: Path) -> None:
    both = Directories(tmp_path / "run", tmp_path / "state")
    serving = held(tmp_path / "run")
    serving.write_status(b"{}")
    before = {path: path.read_bytes() for path in (tmp_path / "run").iterdir()}
    with pytest.raises(AlreadyRunning):
        RuntimeDirectory(both, FILE, serves=False, wait_s=0.0)
    assert {path: path.read_bytes() for path in (tmp_path / "run").iterdir()} == before
    serving.close()


def test_whoever_looks_refuses_nobody_the_lock(tmp_path: Path) -> None:
    there, end = in_one(tmp_path), threading.Event()

    def looks() -> None:
        while not end.is_set():
            look(there)

    looking = threading.Thread(target=looks)
    looking.start()
    try:
        for _ in range(depth(300, 3000)):
            held(tmp_path).close()
    finally:
        end.set()
        looking.join()


def test_a_file_that_must_outlive_the_daemon_is_replaced_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STATE_DIRECTORY", str(tmp_path / "var" / "doors"))
    kept = MemoryFile(state_file(Path("/etc/rmf-bridges/doors.yaml")))
    assert kept.read() is None
    kept.write(b"one")
    kept.write(b"two")
    assert kept.read() == b"two"
    assert [path.name for path in (tmp_path / "var" / "doors").iterdir()] == ["kept.json"]
    monkeypatch.delenv("STATE_DIRECTORY")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "home"))
    assert state_file(Path("doors.yaml")) == tmp_path / "home/rmf-bridge/doors/kept.json"


def test_a_record_that_the_state_directory_cannot_take_goes_to_the_runtime_directory(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    state, runtime = tmp_path / "state" / "kept.json", tmp_path / "run" / "kept.json"
    kept = MemoryFile(state, runtime)
    kept.write(b"one")
    state.unlink()
    state.mkdir()  # no file can replace a directory
    kept.write(b"two")
    kept.write(b"three")
    assert (kept.read(), runtime.read_bytes()) == (b"three", b"three")
    assert [r.getMessage().split(" ")[0] for r in caplog.records] == ["not_written"]
    state.rmdir()
    state.write_bytes(b"one")  # an old record from before the failure
    assert MemoryFile(state, runtime).read() == b"three"
    kept.write(b"four")
    assert (MemoryFile(state, runtime).read(), runtime.exists()) == (b"four", False)


def test_the_memory_of_a_simulation_has_one_path_and_stays_there(tmp_path: Path) -> None:
    """A simulated coordinator keeps its memory in the directory that serves a real one as a spare."""
    path = tmp_path / "run" / "kept.json"
    kept = MemoryFile(path, path)
    kept.write(b"one")
    kept.write(b"two")
    assert MemoryFile(path, path).read() == b"two"


def test_where_neither_directory_can_be_written_the_old_record_stands(tmp_path: Path) -> None:
    state, runtime = tmp_path / "state" / "kept.json", tmp_path / "run" / "kept.json"
    kept = MemoryFile(state, runtime)
    kept.write(b"one")
    for folder in (state.parent, runtime.parent):
        folder.mkdir(exist_ok=True)
        (folder / ".kept.json.new").mkdir()
    with pytest.raises(OSError, match=r"kept\.json\.new"):
        kept.write(b"two")
    assert kept.read() == b"one"
