"""Foreign processes that read the lock file or wait for the lock. They must not prevent that a dead
daemon's relays are switched off.

No run of a daemon switches the outputs of another run off.
"""

import fcntl
import os
import signal
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from bridges.runtime import record
from bridges.runtime.holder import HOLDER
from bridges.runtime.runtime_directory import LOCK, RuntimeDirectory
from bridges.settings.load import load
from bridges.system.directories import Directories
from tests.runtime.hostile import NOBODY, group_member, unit
from tests.runtime.site import Graph, Module, command, daemon, environment, hold_open
from tests.waiting import wait_until


@pytest.fixture
def public() -> Iterator[Path]:
    """Yield a directory that other users can reach. The directories of pytest are private."""
    with tempfile.TemporaryDirectory(dir="/tmp") as folder:
        yield Path(folder)


def told(*arguments: str | Path, **env: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        command(*arguments), env=environment(**env), capture_output=True, text=True
    )


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_a_member_of_the_group_who_waits_for_every_lock_keeps_no_relay_on(
    module: Module, graph: Graph, public: Path
) -> None:
    os.chmod(public, 0o755)
    run = public / "run"
    run.mkdir()
    os.chown(run, 0, NOBODY)
    run.chmod(0o2750)
    (run / "lock").write_text('{"pid":1,"file":"x","serves":true}')  # an older version's file
    (run / "lock").chmod(0o640)
    with daemon(module.file, run, **unit(run, "a")) as running:
        hold_open(module, graph, running)
        with group_member(run) as readable:
            assert ("lock" in readable, HOLDER in readable, LOCK in readable) == (True, True, False)
            running.end(signal.SIGKILL)
            off = told("outputs-off", module.file, **unit(run, "none"), SERVICE_RESULT="signal")
            assert (off.returncode, module.relay()) == (0, [True, False]), off.stderr
            with daemon(module.file, run, **unit(run, "b")) as again:
                again.wait_for("ready")


def test_a_run_whose_claim_is_unreleased_is_switched_off_even_if_the_lock_is_held(
    module: Module, graph: Graph, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    with daemon(module.file, run, **unit(run, "a")) as running:
        hold_open(module, graph, running)
        lock = os.open(run / LOCK, os.O_RDONLY)
        waits = threading.Thread(target=fcntl.flock, args=(lock, fcntl.LOCK_EX))
        waits.start()
        running.end(signal.SIGKILL)
        waits.join()
    ended = {"SERVICE_RESULT": "signal"}
    for stranger in (unit(run, "b") | ended, unit(run, "a")):
        refused = told("outputs-off", module.file, **stranger)
        assert (refused.returncode, module.relay()) == (os.EX_UNAVAILABLE, [True])
        assert str(running.process.pid) not in refused.stderr, "the refusal names a dead process"
    off = told("outputs-off", module.file, **unit(run, "a"), **ended)
    assert (off.returncode, module.relay()) == (0, [True, False]), off.stderr
    os.close(lock)


def test_beside_a_walk_a_run_of_the_service_claims_nothing_and_switches_nothing_off(
    module: Module, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    walk = RuntimeDirectory(Directories(run, run), module.file, serves=False)
    walk.claim(record.of(load(module.file)))
    before = {path.name: path.read_bytes() for path in run.iterdir()}
    with daemon(module.file, run, **unit(run, "a")) as running:
        off = told("outputs-off", module.file, **unit(run, "a"), SERVICE_RESULT="exit-code")
        wait_until(lambda: running.process.poll() is not None, "the run has ended")
        said = running.log.read_text()
    assert (running.process.returncode, off.returncode) == (os.EX_UNAVAILABLE,) * 2
    for text in (said, off.stderr):
        assert f"is in use by process {os.getpid()}" in text
    assert {path.name: path.read_bytes() for path in run.iterdir()} == before
    walk.released()
    walk.close()
