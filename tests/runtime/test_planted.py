"""Directories that another user makes or replaces at the place of a daemon's own directory. The daemon
neither reads nor writes in such a directory."""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from bridges import cli
from bridges.runtime import daemons as status
from bridges.runtime import holder, runtime_directory
from bridges.runtime.record import ClaimRecord
from bridges.runtime.runtime_directory import KEPT, MemoryFile, RuntimeDirectory, state_file
from bridges.system import directories
from bridges.system.directories import Directories, Distrusted, opened

NOBODY = 65534
FILE = Path("/etc/rmf-bridges/lift.yaml")
CLAIMED = ClaimRecord(str(FILE), b"kind: lift\n", {})
ROOT = pytest.mark.skipif(os.geteuid() != 0, reason="only root can make files of other users")


def test_a_directory_that_somebody_else_could_have_made_is_not_believed(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir(mode=0o700)
    with opened(mine):
        pass
    (tmp_path / "link").symlink_to(mine)
    with pytest.raises(Distrusted, match="is a symbolic link"), opened(tmp_path / "link"):
        pass
    anybodys = tmp_path / "anybodys"
    anybodys.mkdir()
    anybodys.chmod(0o777)
    (anybodys / "planted").mkdir()
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o1777)
    with opened(shared / "made", make=True):
        pass
    with pytest.raises(Distrusted, match="can be written by other users"), opened(shared):
        pass
    for folder in (anybodys, anybodys / "planted", anybodys / "made"):
        with (
            pytest.raises(Distrusted, match=f"{anybodys} can be written by other users"),
            opened(folder, make=True),
        ):
            pass
    assert not (anybodys / "made").exists()


def a_link(to: Path, place: Path) -> None:
    place.symlink_to(to)
    os.lchown(place, NOBODY, NOBODY)


def a_directory(to: Path, place: Path) -> None:
    place.mkdir()
    (place / "rmf-bridge").symlink_to(to / "rmf-bridge")
    os.chown(place, NOBODY, NOBODY)


def a_link_within(to: Path, place: Path) -> None:
    """Make a directory of another user. Inside is a link to one of our directories."""
    a_directory(to, place)
    (place / "rmf-bridge").unlink()
    (place / "rmf-bridge").mkdir()
    (place / "rmf-bridge" / "lift").symlink_to(to / "rmf-bridge" / "lift")


PLANTED = [a_link, a_directory, a_link_within]


@pytest.fixture
def victim(machine: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the target of an attack: a directory of root. Its files have the same names as a daemon's
    files."""
    for name in ("XDG_RUNTIME_DIR", "XDG_STATE_HOME"):
        monkeypatch.delenv(name)
    monkeypatch.setenv("HOME", "none")
    (machine / "tmp").mkdir()
    (machine / "tmp").chmod(0o1777)
    folder = machine / "victim" / "rmf-bridge" / "lift"
    folder.mkdir(parents=True)
    for name in ("lock", runtime_directory.LOCK, holder.HOLDER, holder.STATUS, KEPT):
        (folder / name).write_text("precious")
    return folder


def files(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir()}


@ROOT
@pytest.mark.parametrize("plant", PLANTED)
@pytest.mark.parametrize("where", ["rmf-bridge-0", "rmf-0"])
def test_what_anybody_plants_below_tmp_is_neither_read_nor_written(
    victim: Path, machine: Path, plant: Callable[[Path, Path], None], where: str
) -> None:
    """The other user plants a directory at `where`. There a daemon that root starts by hand would have
    its runtime directory or its state directory."""
    before = files(victim)
    plant(victim.parents[1], machine / "tmp" / where)
    with pytest.raises(Distrusted):
        runtime_directory.held(FILE, None, serves=True)
    with pytest.raises(PermissionError):
        directories.act_as_owner(directories.by_hand(FILE))
    kept = directories.by_hand(FILE).runtime / KEPT if where == "rmf-bridge-0" else state_file(FILE)
    with pytest.raises(PermissionError):
        MemoryFile(kept).read()
    with pytest.raises(PermissionError):
        MemoryFile(kept).write(b"")
    assert files(victim) == before


@ROOT
@pytest.mark.parametrize("plant", PLANTED)
def test_a_directory_that_is_replaced_under_a_daemon_is_not_written(
    victim: Path, machine: Path, plant: Callable[[Path, Path], None]
) -> None:
    before = files(victim)
    serving = runtime_directory.held(FILE, None, serves=True)
    serving.claim(CLAIMED)
    shutil.rmtree(machine / "tmp" / "rmf-bridge-0")
    plant(victim.parents[1], machine / "tmp" / "rmf-bridge-0")
    with pytest.raises(Distrusted):
        serving.write_status(b"{}")
    serving.released()
    serving.close()
    assert files(victim) == before


@ROOT
def test_a_look_of_root_believes_nothing_that_a_user_has_linked_and_waits_for_no_fifo(
    machine: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = machine / "tmp" / "rmf-bridge-65534"
    one = base / "rmf-bridge" / "fifo"
    one.mkdir(parents=True)
    os.mkfifo(one / holder.STATUS)
    os.mkfifo(one / holder.HOLDER)
    secret = machine / "secret"
    secret.write_text(json.dumps({"devices": {"secret": {}}}))
    (base / "rmf-bridge" / "linked").mkdir()
    (base / "rmf-bridge" / "linked" / holder.STATUS).symlink_to(secret)
    for path in (base, *base.rglob("*")):
        os.lchown(path, NOBODY, NOBODY)
    (machine / "tmp" / "rmf-bridge-1").symlink_to(machine)
    found = {one.name: one.state for one in status.daemons(directories.runtimes(), {}, 0.0)}
    assert found == {"fifo": "stopped", "linked": "stopped"}
    assert cli.main(["status"]) == status.NONE
    assert "secret" not in capsys.readouterr().out


def test_a_link_of_ones_own_on_the_way_is_followed(tmp_path: Path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "home").symlink_to(tmp_path / "disk")
    run = tmp_path / "home" / "run"
    serving = RuntimeDirectory(Directories(run, run), FILE, serves=True)
    assert holder.look(Directories(run, run)) is not None
    serving.close()
