"""The rings of real daemons. A ring is a file with a daemon's latest messages and decisions. Rings
survive a kill, and a daemon needs no library to write a ring."""

import os
import shutil
import signal
from pathlib import Path

import pytest

from bridges.blackbox.entries import Decided, Known, Spoken
from bridges.blackbox.ring import DIED, RingContent
from hal_fakes.wire import wire
from tests.runtime.site import daemon, shipped
from tests.waiting import wait_until


@pytest.fixture
def lift(tmp_path: Path) -> Path:
    return shipped("lift_dry_contact.yaml", tmp_path, wire())


def spoken(ring: Path) -> list[str]:
    """Return the topics of the messages that the daemon has sent, according to the ring."""
    try:
        return [
            one.topic for one in RingContent(ring).entries() if isinstance(one, Spoken) and one.sent
        ]
    except Exception:  # noqa: BLE001 - the ring is not there yet
        return []


def test_after_a_kill_the_ring_has_everything_up_to_it_and_the_next_run_keeps_it(
    lift: Path, tmp_path: Path, domain: int
) -> None:
    place = tmp_path / "run"
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(lift, place, *options) as running:
        wait_until(lambda: len(spoken(place / "ring")) > 2, "states are in the ring")
        running.end(signal.SIGKILL)
    read = RingContent(place / "ring")
    kinds = {type(entry) for entry in read.entries()}
    with daemon(lift, place, *options) as running:
        running.wait_for("ready")
        again = RingContent(place / DIED)
        assert running.end(signal.SIGTERM) == 0

    assert {Known, Decided, Spoken} <= kinds
    assert (read.head.file, read.head.kind, read.head.yaml, read.ended) == (
        os.path.realpath(lift),
        "lift",
        lift.read_bytes(),
        False,
    )
    assert again.head.run == read.head.run
    assert RingContent(place / "ring").ended


def test_a_daemon_serves_on_when_its_ring_is_taken_away_and_makes_another(
    lift: Path, tmp_path: Path, domain: int
) -> None:
    place = tmp_path / "run"
    with daemon(lift, place, "--simulate", "--domain-id", str(domain)) as running:
        running.wait_for("ready")
        first = RingContent(place / "ring").head.run
        shutil.rmtree(place)
        wait_until(lambda: bool(spoken(place / "ring")), "a new ring is written")
        assert RingContent(place / "ring").head.run == first
        assert running.end(signal.SIGTERM) == 0
    assert "recording" in running.log.read_text()


def test_no_daemon_imports_what_only_files_need(lift: Path, tmp_path: Path, domain: int) -> None:
    options = ("--simulate", "--domain-id", str(domain))
    with daemon(lift, tmp_path / "run", *options, program=("tests.blackbox.imported",)) as running:
        wait_until(lambda: bool(spoken(tmp_path / "run" / "ring")), "the daemon records")
        running.end(signal.SIGTERM)

    assert "imported []" in running.log.read_text()


def test_a_daemon_set_to_keep_nothing_has_no_ring(lift: Path, tmp_path: Path, domain: int) -> None:
    lift.write_text(f"recording: {{keep: nothing}}\n{lift.read_text()}")
    with daemon(lift, tmp_path / "run", "--simulate", "--domain-id", str(domain)) as running:
        running.wait_for("ready")
        assert not (tmp_path / "run" / "ring").exists()
        running.end(signal.SIGTERM)
