"""`rmf-bridge backup`: the files that it saves or leaves out, and the content of a restored machine."""

import argparse
import io
import os
import shutil
import subprocess
import tarfile
import time
from collections.abc import Callable
from pathlib import Path
from textwrap import indent
from typing import Any

import pytest

from bridges import cli
from bridges.commands import backup
from bridges.commands.backup import AHEAD_S, FRESH_S, PAGE_USERS
from bridges.runtime.runtime_directory import KEPT
from bridges.runtime.services import make_user
from bridges.system.directories import user_of

ROOT = Path(__file__).parents[2]
WANTS = "etc/systemd/system/rmf-bridges.target.wants"


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """Return the root of a machine with one enabled door, one disabled door, a secret, users, and the
    memory of a supervisor."""
    root = tmp_path / "old"
    config, state = root / "etc/rmf-bridges", root / "var/lib/rmf-bridge/door_supervisor"
    for folder in (config, state, root / WANTS, (root / PAGE_USERS).parent):
        folder.mkdir(parents=True)
    shutil.copy(ROOT / "config/door_modbus.yaml", config / "ward.yaml")
    shutil.copy(ROOT / "config/door_modbus.yaml", config / "spare.yaml")
    (root / WANTS / "rmf-bridge@ward.service").symlink_to(
        "/usr/lib/systemd/system/rmf-bridge@.service"
    )
    for name, mode in {"ward.token": 0o600, "page.env": 0o644}.items():
        (config / name).write_text(f"content of {name}")
        (config / name).chmod(mode)
    (state / KEPT).write_text("held")
    (root / PAGE_USERS).write_text("ann: hash")
    (root / PAGE_USERS).chmod(0o600)
    return root


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Return the list of commands that the test runs. Each command succeeds."""
    found: list[list[str]] = []

    def run(words: list[str]) -> subprocess.CompletedProcess[str]:
        found.append(list(words))
        return subprocess.CompletedProcess(words, 0)

    monkeypatch.setattr(subprocess, "run", run)
    return found


def saved(root: Path, file: Path) -> int:
    return cli.main(["backup", str(file), "--root", str(root)])


def restored(root: Path, file: Path, *options: str) -> int:
    root.mkdir(exist_ok=True)
    return cli.main(["backup", str(file), "--restore", "--root", str(root), *options])


def content(root: Path) -> dict[str, str]:
    return {str(p.relative_to(root)): p.read_text() for p in root.rglob("*") if p.is_file()}


def as_nobody(code: Callable[[], int]) -> int:
    """Run this as a user who owns nothing, and return its result, an exit code."""
    if pid := os.fork():
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    try:
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)
        os._exit(code())
    finally:
        os._exit(99)


MEMORY = f"var/lib/rmf-bridge/door_supervisor/{KEPT}"


def test_a_restored_machine_has_the_same_files_and_services_and_no_secret_was_saved(
    machine: Path, tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    assert saved(machine, file) == 0
    assert "left out, as a secret: /etc/rmf-bridges/ward.token" in capsys.readouterr().out
    assert file.stat().st_mode & 0o777 == 0o600
    assert restored(new, file) == 0
    drop_in = "etc/systemd/system/rmf-bridge@ward.service.d/10-enable.conf"
    before = content(machine)
    del before["etc/rmf-bridges/ward.token"]
    after = content(new)
    assert drop_in in after
    assert {name: after[name] for name in after if name != drop_in} == before
    assert calls == [
        ["systemd-sysusers", f"--root={new}", *make_user("ward").words[1:]],
        ["systemctl", f"--root={new}", "enable", "rmf-bridges.target", "rmf-bridge@ward.service"],
    ]
    assert (new / PAGE_USERS).stat().st_mode & 0o777 == 0o600


def test_an_old_memory_is_not_restored_because_it_would_open_a_door(
    machine: Path, tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    long_ago = time.time() - FRESH_S - 60
    os.utime(machine / MEMORY, (long_ago, long_ago))
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    saved(machine, file)
    assert restored(new, file) == 0
    assert MEMORY not in content(new)
    assert f"left out, because it is older than 1 h: /{MEMORY}" in capsys.readouterr().out


@pytest.mark.parametrize(("ahead_s", "fresh"), [(AHEAD_S - 30, True), (86400.0, False)])
def test_a_memory_from_the_future_is_not_restored_because_a_wrong_clock_hides_its_age(
    machine: Path,
    tmp_path: Path,
    calls: list[list[str]],
    capsys: pytest.CaptureFixture[str],
    ahead_s: float,
    fresh: bool,
) -> None:
    later = time.time() + ahead_s
    os.utime(machine / MEMORY, (later, later))
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    saved(machine, file)
    assert restored(new, file) == 0
    why = "left out, because it is newer than this machine's clock, which may be wrong"
    assert (MEMORY in content(new), f"{why}: /{MEMORY}" not in capsys.readouterr().out) == (
        fresh,
        fresh,
    )


def test_a_backup_with_an_invalid_yaml_changes_nothing(
    machine: Path, tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    (machine / "etc/rmf-bridges/ward.yaml").write_text("kind: dor\n")
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    saved(machine, file)
    assert restored(new, file) == os.EX_CONFIG
    assert "ward.yaml:1:7" in capsys.readouterr().err
    assert (content(new), calls) == ({}, [])


@pytest.mark.parametrize(
    "name", ["../etc/passwd", "/etc/passwd", "etc/passwd", "etc/rmf-bridges/../passwd"]
)
def test_a_backup_with_a_file_outside_our_folders_is_refused(tmp_path: Path, name: str) -> None:
    file, new = tmp_path / "bad.tar.gz", tmp_path / "new"
    with tarfile.open(file, "w:gz") as out:
        member = tarfile.TarInfo(name)
        member.size = 4
        out.addfile(member, io.BytesIO(b"root"))
    assert restored(new, file) == os.EX_NOINPUT
    assert content(new) == {}


def test_a_link_in_a_backup_and_a_file_that_is_no_archive_are_refused(tmp_path: Path) -> None:
    file, new = tmp_path / "bad.tar.gz", tmp_path / "new"
    with tarfile.open(file, "w:gz") as out:
        member = tarfile.TarInfo("etc/rmf-bridges/a.yaml")
        member.type, member.linkname = tarfile.SYMTYPE, "/etc/passwd"
        out.addfile(member)
    assert restored(new, file) == os.EX_NOINPUT
    file.write_bytes(b"nothing")
    assert restored(new, file) == os.EX_NOINPUT


def test_a_dry_run_only_prints_the_steps(
    machine: Path, tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    saved(machine, file)
    assert restored(new, file, "--dry-run") == 0
    assert "write /etc/rmf-bridges/ward.yaml" in capsys.readouterr().out
    assert (content(new), calls) == ({}, [])


def test_a_second_backup_does_not_overwrite_the_first_and_a_dry_run_writes_nothing(
    machine: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "backup.tar.gz"
    line = ["backup", str(file), "--root", str(machine)]
    assert cli.main([*line, "--dry-run"]) == 0
    assert "to save: /etc/rmf-bridges/ward.yaml" in capsys.readouterr().out
    assert not file.exists()
    file.write_text("another file")
    assert cli.main(line) == os.EX_CANTCREAT
    assert file.read_text() == "another file"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is Linux's")
def test_a_backup_that_finds_no_room_leaves_no_file_and_the_next_try_succeeds(
    machine: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file, real = tmp_path / "backup.tar.gz", os.open

    def on_a_full_disk(path: Path, flags: int, mode: int = 0o777, **rest: Any) -> int:
        opened = real(path, flags, mode, **rest)
        if path == file:
            full = real("/dev/full", os.O_WRONLY)
            os.dup2(full, opened)
            os.close(full)
        return opened

    with monkeypatch.context() as disk:
        disk.setattr(os, "open", on_a_full_disk)
        assert saved(machine, file) == os.EX_CANTCREAT
    assert capsys.readouterr().err == f"{file} cannot be written: No space left on device\n"
    assert not file.exists()
    assert saved(machine, file) == 0


def test_a_machine_without_files_has_nothing_to_save(tmp_path: Path) -> None:
    assert saved(tmp_path, tmp_path / "backup.tar.gz") == os.EX_NOINPUT
    assert not (tmp_path / "backup.tar.gz").exists()


def test_links_are_saved_as_the_files_behind_them(
    machine: Path, tmp_path: Path, calls: list[list[str]]
) -> None:
    config, home = machine / "etc/rmf-bridges", machine / "srv"
    home.mkdir()
    (config / "ward.yaml").rename(home / "ward.yaml")
    (config / "ward.yaml").symlink_to("../../srv/ward.yaml")
    (home / "ca.pem").write_text("certificate")
    (config / "ca.pem").symlink_to(home / "ca.pem")
    (config / "again.pem").hardlink_to(home / "ca.pem")
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    assert saved(machine, file) == 0
    assert restored(new, file) == 0
    after = content(new)
    for name in ("ward.yaml", "ca.pem", "again.pem"):
        assert after[f"etc/rmf-bridges/{name}"] == (config / name).read_text()
    assert calls[-1][-1] == "rmf-bridge@ward.service"


def test_what_cannot_be_saved_is_told_and_the_rest_can_be_restored(
    machine: Path, tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    config = machine / "etc/rmf-bridges"
    (tmp_path / "host.pem").touch()
    (config / "of_host.pem").symlink_to(tmp_path / "host.pem")
    (config / "dangling.pem").symlink_to("nowhere.pem")
    (config / "folder").symlink_to(machine / "var")
    os.mkfifo(config / "pipe")
    with (config / "core").open("wb") as big:
        big.truncate(backup.MOST_BYTES + 1)
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    assert saved(machine, file) == os.EX_NOINPUT
    assert capsys.readouterr().err.splitlines() == [
        f"NOT saved: {config}/core: it is larger than 16 MiB",
        f"NOT saved: {config}/dangling.pem: No such file or directory",
        f"NOT saved: {config}/folder: it is no regular file",
        f"NOT saved: {config}/of_host.pem: it is a link that leads out of {machine}",
        f"NOT saved: {config}/pipe: it is no regular file",
    ]
    assert restored(new, file) == 0


def test_a_service_whose_yaml_is_a_secret_is_named_at_the_backup_and_at_the_restore(
    machine: Path, tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    ward = machine / "etc/rmf-bridges/ward.yaml"
    ward.chmod(0o600)
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    assert saved(machine, file) == os.EX_DATAERR
    told = capsys.readouterr()
    assert "left out, as a secret: /etc/rmf-bridges/ward.yaml" in told.out
    assert told.err == (
        "the service rmf-bridge@ward.service cannot be restored from this backup, which lacks"
        " /etc/rmf-bridges/ward.yaml: copy this file by hand\n"
    )
    assert restored(new, file) == os.EX_DATAERR
    assert capsys.readouterr().err == (
        "the service rmf-bridge@ward.service is NOT restored, because the backup lacks"
        " /etc/rmf-bridges/ward.yaml: copy this file, then run rmf-bridge enable"
        " /etc/rmf-bridges/ward.yaml\n"
    )
    assert calls == []
    shutil.copy(ward, new / "etc/rmf-bridges/ward.yaml")  # a person has copied it
    (new / "etc/passwd").write_text(f"{user_of('ward')}:x:{os.geteuid()}:0::/:/usr/sbin/nologin\n")
    assert restored(new, file) == 0
    assert calls[-1][-1] == "rmf-bridge@ward.service"


def test_a_yaml_is_restored_together_with_the_dbc_file_that_it_names(
    machine: Path, tmp_path: Path, calls: list[list[str]]
) -> None:
    config = machine / "etc/rmf-bridges"
    shutil.copy(ROOT / "drivers/profiles/wiferion.dbc", config / "ours.dbc")
    _, frames = (ROOT / "drivers/profiles/wiferion.yaml").read_text().split("\nmap:\n")
    frames = indent(frames.replace("wiferion.dbc", "/etc/rmf-bridges/ours.dbc"), "    ")
    station = (ROOT / "config/charger_wiferion.yaml").read_text()
    (config / "ward.yaml").write_text(
        station.replace("    profile: wiferion\n", f"    map:\n{frames}\n")
    )
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    assert saved(machine, file) == 0
    assert restored(new, file) == 0
    assert calls[-1][-1] == "rmf-bridge@ward.service"


@pytest.mark.parametrize("lost", ["", "fleet_tiny.yaml", "fleet_tiny_graph.yaml"])
def test_a_fleet_is_restored_only_with_the_files_that_it_names(
    machine: Path,
    tmp_path: Path,
    calls: list[list[str]],
    capsys: pytest.CaptureFixture[str],
    lost: str,
) -> None:
    config = machine / "etc/rmf-bridges"
    for name in ("fleet_tiny.yaml", "fleet_tiny_graph.yaml"):
        shutil.copy(ROOT / "config" / name, config)
    shutil.copy(ROOT / "config/robots_http.yaml", config / "ward.yaml")
    if lost:
        (config / lost).unlink()
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    saved(machine, file)
    assert restored(new, file) == (os.EX_CONFIG if lost else 0)
    assert (content(new) == {}) == bool(lost)
    assert lost in capsys.readouterr().err


def test_only_root_saves_and_restores_a_running_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    file = tmp_path / "backup.tar.gz"
    for options in ([], ["--restore"]):
        assert cli.main(["backup", str(file), *options]) == os.EX_NOPERM
        assert capsys.readouterr().err.startswith("only root may do that")
    assert not file.exists()


@pytest.mark.parametrize("options", [[], ["--restore"]])
def test_a_root_that_is_not_mounted_is_reported_and_not_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str]
) -> None:
    root, file = tmp_path / "card", tmp_path / "backup.tar.gz"
    assert cli.main(["backup", str(file), *options, "--root", str(root)]) == os.EX_NOINPUT
    assert capsys.readouterr().err == f"{root} is not a folder: is the card mounted?\n"
    assert not root.exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize(
    ("closed", "mode"),
    [
        (str(PAGE_USERS.parent), 0o700),
        ("var/lib/rmf-bridge/door_supervisor", 0o750),
        ("var/lib/rmf-bridge", 0o700),
        ("etc/rmf-bridges", 0o700),
        ("etc/rmf-bridges/page.env", 0o640),
        (MEMORY, 0o600),
    ],
)
def test_a_place_that_this_user_may_not_read_is_told_and_no_success(
    machine: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    closed: str,
    mode: int,
) -> None:
    (machine / PAGE_USERS).chmod(0o644)
    (machine / closed).chmod(mode)
    machine.chmod(0o777)
    monkeypatch.chdir(machine)  # nobody may not reach this folder by its whole path
    args = argparse.Namespace(file=Path("b.tar.gz"), root=Path(), restore=False, dry_run=False)
    assert as_nobody(lambda: backup.run(args)) == os.EX_NOINPUT
    told = capfd.readouterr().err
    assert f"NOT saved: {closed}: Permission denied\n" in told
    assert "Traceback" not in told


@pytest.mark.parametrize("bytes_left", [0, 40, 200])
def test_a_truncated_backup_is_refused_in_one_line(
    machine: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], bytes_left: int
) -> None:
    file, new = tmp_path / "backup.tar.gz", tmp_path / "new"
    saved(machine, file)
    file.write_bytes(file.read_bytes()[:bytes_left])
    assert restored(new, file) == os.EX_NOINPUT
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert content(new) == {}
