"""What `rmf-bridge notify` keeps on disk, while the disk is full and afterwards. Time is virtual."""

import logging
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from bridges.runtime import daemons
from bridges.system import directories
from tests.system.test_certificates import certificate
from workbench.commands.notify import ACKNOWLEDGED, TOLD, Desk, Kept
from workbench.explain.heard_devices import HeardDevices
from workbench.notify.settings import NotifySettings


@pytest.fixture
def state(tmp_path: Path) -> Path:
    """Return a folder in which nothing can be stored until `makes_room`."""
    (tmp_path / f".{TOLD}.new").mkdir()
    return tmp_path


def makes_room(state: Path) -> None:
    (state / f".{TOLD}.new").rmdir()


@pytest.fixture
def desk(state: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """Return a desk with one trouble: a certificate has ended."""
    monkeypatch.setattr(directories, "runtimes", no_folders)
    monkeypatch.setattr(daemons, "units", dict)
    ended = certificate(state / "page.pem", -3.5)
    return Desk(NotifySettings(to=[], certificates=[ended], after_s=1.0), state, "notify", [])


def no_folders() -> Iterator[Path]:
    yield from ()


def turns(desk: Desk, seconds: int) -> None:
    """Let the desk look at an empty site once each second."""
    site = HeardDevices()
    for second in range(seconds):
        site.pass_time(time.monotonic() + second, time.time() + second)
        desk.turn(site)


def acknowledged(state: Path) -> list[bool]:
    """Return whether each stored trouble is acknowledged."""
    kept = msgspec.json.decode((state / TOLD).read_bytes(), type=Kept)
    return [one.acknowledged for one in kept.told]


def test_what_people_know_is_stored_once_the_disk_has_room_and_is_logged_once_before(
    desk: Desk, state: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.ERROR):
        turns(desk, 60)
    assert [record.getMessage().split()[0] for record in caplog.records] == ["not_kept"]
    makes_room(state)
    turns(desk, 1)
    assert acknowledged(state) == [False]


def test_an_acknowledgement_is_not_lost_while_the_disk_has_no_room(desk: Desk, state: Path) -> None:
    turns(desk, 10)
    asked = state / f"{ACKNOWLEDGED}1"
    asked.write_text(f"daemon notify: CERTIFICATE_EXPIRES certificates {state / 'page.pem'}")
    turns(desk, 10)
    assert asked.exists()
    makes_room(state)
    turns(desk, 1)
    assert acknowledged(state) == [True]
    assert not asked.exists()
