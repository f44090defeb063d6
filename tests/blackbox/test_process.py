"""The recorder and the commands while a real daemon runs, as an operator runs them."""

import io
import json
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import pytest

from bridges import cli
from bridges.blackbox.entries import Spoken
from bridges.blackbox.ring import RingContent
from bridges.commands import incident
from hal_fakes.wire import wire
from tests.runtime.site import daemon, environment, shipped
from tests.waiting import PATIENCE_S, wait_until
from workbench.replay.bags import heard_in
from workbench.replay.incidents import head_of, notes_in


@pytest.fixture
def lift(tmp_path: Path) -> Path:
    return shipped("lift_dry_contact.yaml", tmp_path, wire())


class Told(NamedTuple):
    """The output and the exit code of a command."""

    returncode: int
    stdout: str
    stderr: str


def bridge(*words: str | Path) -> Told:
    """Run a command in the folder of its file. Wait until the command ends."""
    out, error = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(error), chdir(Path(words[1]).parent):
        code = cli.main([str(word) for word in words])
    return Told(code, out.getvalue(), error.getvalue())


def states(place: Path) -> int:
    """Return the number of messages in the ring."""
    try:
        return sum(isinstance(one, Spoken) for one in RingContent(place / "ring").entries())
    except Exception:  # noqa: BLE001 - the ring is not there yet
        return 0


def test_a_person_records_an_incident_and_replays_it(
    lift: Path, tmp_path: Path, domain: int
) -> None:
    place = tmp_path / "run"
    with daemon(lift, place, "--simulate", "--domain-id", str(domain)) as running:
        wait_until(lambda: states(place) > 8, "states are in the ring")
        where = ("--runtime-dir", str(place))
        made = bridge(
            "incident", lift, "--note", "it stood", "--after", "0", "-o", "a.mcap", *where
        )
        ring = bridge("replay", place / "ring")
        running.end(signal.SIGTERM)
    late = bridge("incident", lift, "-o", "late.mcap", *where)
    file = tmp_path / "a.mcap"
    told = bridge("replay", file, "--json")
    other = tmp_path / "other.yaml"
    other.write_text(lift.read_text())

    assert made.returncode == 0, made.stderr
    assert (
        late.stdout.splitlines()[0] == f"no daemon serves {lift} now, so no later events will come"
    )
    assert (late.returncode, (tmp_path / "late.mcap").exists()) == (0, True)
    assert [(note.code, note.text) for note in notes_in(file)] == [("OPERATOR", "it stood")]
    assert {one.topic for one in heard_in(file)} == {"lift_states", "diagnostics"}
    assert (told.returncode, json.loads(told.stdout)["differences"]) == (0, [])
    assert json.loads(told.stdout)["decisions"] > 5
    assert (ring.returncode, ring.stdout.splitlines()[-1]) == (0, "every decision is as recorded")
    assert bridge("replay", file, "--config", other).stdout.endswith("changed no decision\n")


def test_the_recorder_makes_a_file_of_a_daemon_that_is_killed(
    lift: Path, tmp_path: Path, domain: int
) -> None:
    base = Path(tempfile.mkdtemp(prefix="rec", dir="/tmp"))  # the path of a socket must be short
    place = base / "rmf-bridge" / lift.stem
    place.parent.mkdir(parents=True)
    out = tmp_path / "out"
    recorder = subprocess.Popen(
        [sys.executable, "-m", "bridges.cli", "recorder", "-o", str(out)],
        env=environment(XDG_RUNTIME_DIR=str(base)),
    )
    try:
        with daemon(lift, place, "--simulate", "--domain-id", str(domain)) as running:
            wait_until(lambda: states(place) > 2, "states are in the ring")
            running.end(signal.SIGKILL)
        wait_until(lambda: len(list(out.glob(f"{lift.stem}*.mcap"))) == 1, "a recording is written")
        [file] = out.glob(f"{lift.stem}*.mcap")
    finally:
        recorder.send_signal(signal.SIGTERM)
        code = recorder.wait(PATIENCE_S)
        shutil.rmtree(base)

    assert code == 0
    assert [note.code for note in notes_in(file)] == ["DIED"]
    assert head_of(file).yaml == lift.read_bytes()
    assert bridge("replay", file).returncode == 0


def test_an_incident_of_a_killed_daemon_is_about_its_death(
    lift: Path, tmp_path: Path, domain: int
) -> None:
    place = tmp_path / "run"
    where = ("--runtime-dir", str(place))
    served = (lift, place, "--simulate", "--domain-id", str(domain))
    with daemon(*served) as running, pytest.MonkeyPatch.context() as patch:
        wait_until(lambda: states(place) > 2, "states are in the ring")
        patch.setattr(incident, "_wait", lambda seconds: running.end(signal.SIGKILL))
        hung = bridge("incident", lift, "-o", "hung.mcap", *where)
    dead = bridge("incident", lift, "--note", "it stood", "-o", "dead.mcap", *where)
    with daemon(*served) as running:
        wait_until((place / "ring.died").exists, "the dead run's ring is put aside")
        now = bridge("incident", lift, "--after", "0", "-o", "now.mcap", *where)
        died = bridge("incident", lift, "--died", "-o", "died.mcap", *where)
        running.end(signal.SIGTERM)
    codes = {
        name: [note.code for note in notes_in(tmp_path / f"{name}.mcap")]
        for name in ("hung", "dead", "now", "died")
    }
    told = bridge("explain", tmp_path / "dead.mcap").stdout

    assert [one.returncode for one in (hung, dead, now, died)] == [0, 0, 0, 0]
    assert codes == {
        "hung": ["DIED"],
        "dead": ["DIED", "OPERATOR"],
        "now": ["OPERATOR"],
        "died": ["DIED"],
    }
    assert now.stdout.startswith("an earlier run did not shut down cleanly (it ended at ")
    assert died.stdout.startswith("died.mcap: ")
    assert "This file was kept because the daemon died" in told
    assert 'A person wrote "it stood".' in " ".join(told.split())
    assert "there is nothing to do" not in told


def test_a_command_without_a_ring_or_a_recording_says_what_to_do(
    lift: Path, tmp_path: Path
) -> None:
    none = tmp_path / "none"
    nothing = bridge("incident", lift, "--runtime-dir", str(none))
    died = bridge("incident", lift, "--died", "--runtime-dir", str(none))
    nowhere = bridge("incident", lift, "-o", none / "a.mcap", "--runtime-dir", str(none))
    (tmp_path / "a.mcap").write_bytes(b"\x89MCAP0\r\n")
    no_head = bridge("replay", tmp_path / "a.mcap")

    assert (nothing.returncode, nothing.stdout) == (69, "")
    assert nothing.stderr == (
        f"{none}/ring cannot be read: No such file or directory."
        " Does the daemon run, and does the YAML keep a ring?\n"
    )
    assert died.stderr == (
        f"{none}/ring.died cannot be read: No such file or directory."
        " --died records the run before the last run; without --died the last run is recorded\n"
    )
    assert (nowhere.returncode, nowhere.stdout, nowhere.stderr) == (
        73,
        "",
        f"{none}/a.mcap cannot be written: No such file or directory\n",
    )
    assert no_head.returncode == 66
    assert "Traceback" not in nothing.stderr + no_head.stderr
