"""`enable` and `disable`: their steps in order, and their refusals."""

import argparse
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from bridges.cli import main
from bridges.commands import disable, enable
from bridges.runtime import drop_in, services
from bridges.runtime.runtime_directory import RuntimeDirectory
from bridges.runtime.services import (
    GiveSecret,
    Remove,
    Run,
    WriteFile,
    carry_out,
    make_user,
    switch_off,
)
from bridges.settings.load import load
from bridges.system.directories import Directories, user_of

CONFIG = Path(__file__).parents[2] / "config"
LIFT = CONFIG / "lift_dry_contact.yaml"
UNIT = "rmf-bridge@lift_dry_contact.service"
USER = user_of("lift_dry_contact")
DROP_IN = f"etc/systemd/system/{UNIT}.d/10-enable.conf"
TARGET = "etc/rmf-bridges/lift_dry_contact.yaml"


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Return the list of commands that the test runs. Each command succeeds."""
    found: list[list[str]] = []

    class Done:
        returncode = 0

    def run(words: list[str]) -> Done:
        found.append(list(words))
        return Done()

    monkeypatch.setattr(subprocess, "run", run)
    return found


def test_an_instance_is_stopped_and_off_before_its_file_and_drop_in_change(tmp_path: Path) -> None:
    config = load(LIFT)
    assert list(enable.steps(config, tmp_path, ["gpio"])) == [
        Run(("systemctl", "stop", UNIT), running_only=True),
        switch_off("lift_dry_contact"),
        make_user("lift_dry_contact"),
        WriteFile(tmp_path / TARGET, LIFT.read_bytes(), LIFT),
        WriteFile(tmp_path / DROP_IN, drop_in.text(config, ["gpio"], USER).encode()),
        Run(("systemctl", "daemon-reload"), running_only=True),
        Run(("systemctl", "enable", "rmf-bridges.target", UNIT)),
        Run(("systemctl", "start", UNIT), running_only=True),
    ]
    assert list(disable.steps("lift_dry_contact", tmp_path)) == [
        Run(("systemctl", "stop", UNIT), running_only=True),
        Run(("systemctl", "disable", UNIT)),
        switch_off("lift_dry_contact"),
        Remove(tmp_path / DROP_IN),
        Run(("systemctl", "daemon-reload"), running_only=True),
    ]


def test_outputs_left_on_are_switched_off_by_the_record_of_the_installed_file() -> None:
    assert switch_off("a").words[1:] == (
        "-P",
        "-m",
        "bridges.cli",
        "outputs-off",
        "/etc/rmf-bridges/a.yaml",
    )
    assert switch_off("a").state == Path("/var/lib/rmf-bridge/a")


def test_a_system_that_is_not_running_gets_file_and_drop_in_and_links(
    tmp_path: Path, calls: list[list[str]]
) -> None:
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/group").write_text("gpio:x:99:\nwheel:x:1:\n")
    assert main(["enable", str(LIFT), "--root", str(tmp_path)]) == 0
    written = (tmp_path / DROP_IN).read_text()
    assert written == drop_in.text(load(LIFT), ["gpio"], USER)
    assert (tmp_path / TARGET).read_bytes() == LIFT.read_bytes()
    assert (tmp_path / TARGET).stat().st_mode & 0o777 == 0o644
    assert main(["disable", "lift_dry_contact", "--root", str(tmp_path)]) == 0
    assert not (tmp_path / DROP_IN).parent.exists()
    assert (tmp_path / TARGET).exists()
    root = f"--root={tmp_path}"
    assert calls == [
        ["systemd-sysusers", root, *make_user("lift_dry_contact").words[1:]],
        ["systemctl", root, "enable", "rmf-bridges.target", UNIT],
        ["systemctl", root, "disable", UNIT],
    ]


def test_the_installed_file_itself_is_enabled_again_without_a_copy(
    tmp_path: Path, calls: list[list[str]]
) -> None:
    main(["enable", str(LIFT), "--root", str(tmp_path)])
    installed = tmp_path / TARGET
    assert not [
        s for s in enable.steps(load(installed), tmp_path, []) if s == WriteFile(installed, b"")
    ]
    assert [type(s).__name__ for s in enable.steps(load(installed), tmp_path, [])].count(
        "WriteFile"
    ) == 1


@pytest.mark.parametrize("command", ["enable", "disable"])
def test_a_card_that_is_not_mounted_is_reported_before_the_first_step(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str], command: str
) -> None:
    root = tmp_path / "card"
    assert main([command, str(LIFT), "--root", str(root), "--dry-run"]) == os.EX_NOINPUT
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", f"{root} is not a folder: is the card mounted?\n")
    assert main([command, str(LIFT), "--root", str(root)]) == os.EX_NOINPUT
    assert (root.exists(), calls) == (False, [])


def test_a_dry_run_prints_every_step_and_does_nothing(
    tmp_path: Path,
    calls: list[list[str]],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(disable, "services", lambda root: {"lift_dry_contact"})
    assert main(["disable", str(LIFT), "--dry-run"]) == 0
    assert main(["enable", str(LIFT), "--root", str(tmp_path), "--dry-run"]) == 0
    printed = capsys.readouterr().out.splitlines()
    off = f"{sys.executable} -P -m bridges.cli outputs-off /{TARGET}"
    assert printed[:8] == [
        f"systemctl stop {UNIT}",
        f"systemctl disable {UNIT}",
        f"{off}   # if a dead daemon left a record in /var/lib/rmf-bridge/lift_dry_contact",
        f"rm /{DROP_IN}",
        "systemctl daemon-reload",
        shlex.join(make_user("lift_dry_contact").words),
        f"install -m 644 {LIFT} {tmp_path / TARGET}",
        f"write {tmp_path / DROP_IN}:",
    ]
    assert (calls, list(tmp_path.iterdir())) == ([], [])


def test_without_a_start_all_other_steps_are_done(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["enable", str(LIFT), "--dry-run"]) == 0
    whole = capsys.readouterr().out.splitlines()
    assert main(["enable", str(LIFT), "--dry-run", "--no-start"]) == 0
    assert capsys.readouterr().out.splitlines() == whole[:-1]
    assert whole[-1] == f"systemctl start {UNIT}"


@pytest.mark.parametrize("simulated", [False, True])
def test_a_file_that_a_person_runs_becomes_no_service_unless_it_is_simulated(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    simulated: bool,
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    run = tmp_path / "rmf-bridge" / "lift_dry_contact"
    serving = RuntimeDirectory(Directories(run, run), LIFT, serves=True)
    serving.write_status(json.dumps({"simulated": simulated}).encode())
    code = main(["enable", str(LIFT), "--dry-run"])
    told = capsys.readouterr()
    assert (code, told.out == "") == ((0, False) if simulated else (os.EX_UNAVAILABLE, True))
    stop = f"Ctrl-C where it runs, or kill {os.getpid()}"
    assert (stop in told.err) != simulated
    serving.close()
    assert main(["enable", str(LIFT), "--dry-run"]) == 0


def test_pins_of_another_service_are_refused_with_their_place(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    main(["enable", str(LIFT), "--root", str(tmp_path)])
    other = CONFIG / "lift_relay_board.yaml"
    assert main(["enable", str(other), "--root", str(tmp_path)]) == os.EX_CONFIG
    told = capsys.readouterr().err
    assert f"BCM16 of the header is used in {tmp_path / TARGET} too, on line" in told
    assert [path.name for path in (tmp_path / "etc/rmf-bridges").iterdir()] == [LIFT.name]


@pytest.mark.parametrize("enabled", [True, False])
def test_the_file_of_a_disabled_service_still_blocks_its_pins_but_this_is_told(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str], enabled: bool
) -> None:
    main(["enable", str(LIFT), "--root", str(tmp_path)])
    if enabled:  # the test's systemctl makes no link
        link = tmp_path / "etc/systemd/system/rmf-bridges.target.wants" / UNIT
        link.parent.mkdir()
        link.symlink_to("/usr/lib/systemd/system/rmf-bridge@.service")
    other = CONFIG / "lift_relay_board.yaml"
    assert main(["enable", str(other), "--root", str(tmp_path)]) == os.EX_CONFIG
    told = capsys.readouterr().err
    assert f" is used in {tmp_path / TARGET} too" in told
    advice = (
        f"lift_dry_contact is disabled: if it is no longer used, move {tmp_path / TARGET} away\n"
    )
    assert told.endswith(advice) != enabled


@pytest.mark.parametrize("name", ["my lift.yaml", "-x.yaml", "a@b.yaml", "%i.yaml"])
def test_a_file_that_cannot_name_a_service_is_refused(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / name
    file.write_bytes(LIFT.read_bytes())
    assert enable.run(_told(file, tmp_path)) == os.EX_CONFIG
    assert "is not a service name" in capsys.readouterr().err


def test_the_recipients_of_notify_are_no_service_and_no_service_takes_their_place(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    recipients = tmp_path / "root/etc/rmf-bridges/notify.yaml"
    recipients.parent.mkdir(parents=True)
    recipients.write_text("recipients: {}\n")
    file, root = tmp_path / "notify.yaml", ["--root", str(tmp_path / "root")]
    file.write_bytes(LIFT.read_bytes())
    assert main(["enable", str(file), *root]) == os.EX_CONFIG
    assert capsys.readouterr().err == enable.RESERVED.format(file) + "\n"
    assert recipients.read_text() == "recipients: {}\n"
    assert main(["disable", "notify", *root]) == os.EX_USAGE
    assert capsys.readouterr().err == "no service notify; there is none\n"
    assert calls == []


def test_a_service_named_notify_of_an_earlier_version_can_be_upgraded_and_disabled(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    file, root = tmp_path / "notify.yaml", ["--root", str(tmp_path)]
    file.write_bytes(LIFT.read_bytes())
    assert main(["enable", "--drop-in", str(file), *root]) == 0
    left = tmp_path / "etc/systemd/system/rmf-bridge@notify.service.d/10-enable.conf"
    left.parent.mkdir(parents=True)
    left.write_text(capsys.readouterr().out)
    assert main(["disable", "notify", *root]) == 0


def _told(file: Path, root: Path) -> argparse.Namespace:
    return argparse.Namespace(file=file, root=root, dry_run=True, no_start=False, drop_in=False)


def test_only_root_changes_a_running_system(
    monkeypatch: pytest.MonkeyPatch, calls: list[list[str]]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert main(["enable", str(LIFT)]) == os.EX_NOPERM
    assert main(["disable", "lift_dry_contact"]) == os.EX_NOPERM
    assert calls == []


@pytest.mark.parametrize(
    "left",
    [
        "etc/rmf-bridges/my.lift.yaml",
        "etc/systemd/system/rmf-bridge@my.lift.service.d/10-enable.conf",
        "etc/systemd/system/rmf-bridges.target.wants/rmf-bridge@my.lift.service",
        "var/lib/rmf-bridge/my.lift/claimed-1.json",
    ],
)
@pytest.mark.parametrize("name", ["my.lift", "/x/my.lift.yaml", "my.lift.yml"])
def test_a_service_with_one_file_left_can_be_disabled(
    tmp_path: Path, calls: list[list[str]], left: str, name: str
) -> None:
    (tmp_path / left).parent.mkdir(parents=True)
    (tmp_path / left).touch()
    assert main(["disable", name, "--root", str(tmp_path)]) == 0
    assert calls == [["systemctl", f"--root={tmp_path}", "disable", "rmf-bridge@my.lift.service"]]


def test_the_name_of_no_service_is_refused_with_the_known_names(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    root = ["--root", str(tmp_path)]
    main(["enable", str(LIFT), *root])
    calls.clear()
    assert main(["disable", "lift_dry", *root]) == os.EX_USAGE
    assert capsys.readouterr().err == "no service lift_dry; there is lift_dry_contact\n"
    assert main(["disable", "lift_dry", *root, "--dry-run"]) == os.EX_USAGE
    assert calls == []


def test_a_relay_that_is_not_verified_off_keeps_its_drop_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    left = tmp_path / "ward" / "claimed-1.json"
    left.parent.mkdir()
    kept = tmp_path / "drop_in"
    kept.touch()
    words = (sys.executable, "-c", "raise SystemExit(1)")
    off = services.SwitchOff(words, left.parent)
    live = _told(LIFT, Path("/"))
    live.dry_run = False
    assert carry_out([off], live) == 0  # no record of outputs, so no output can be on
    left.touch()
    assert carry_out([off, Remove(kept)], live) == os.EX_UNAVAILABLE
    told = capsys.readouterr().err
    assert "the outputs of ward are not verified off" in told
    assert f"rm {left}" in told
    assert kept.exists()


def test_outputs_are_switched_off_in_the_services_own_directories(tmp_path: Path) -> None:
    left = tmp_path / "ward" / "claimed-1.json"
    left.parent.mkdir()
    left.touch()
    places = {"RUNTIME_DIRECTORY": "/run/rmf-bridge/ward", "STATE_DIRECTORY": str(left.parent)}
    code = f"import os, sys; sys.exit(not {places!r}.items() <= os.environ.items())"
    assert services._off((sys.executable, "-c", code), left.parent) == 0


def test_after_a_failed_step_the_stopped_service_starts_again(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    calls: list[list[str]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    (tmp_path / "file").touch()
    live = _told(LIFT, Path("/"))
    live.dry_run = False
    full = WriteFile(
        tmp_path / "file" / "drop_in", b""
    )  # a missing folder raises OSError, like a full disk
    assert carry_out([full, Remove(tmp_path / "never")], live, keeps=UNIT) == os.EX_IOERR
    assert calls == [["systemctl", "--quiet", "is-active", UNIT], ["systemctl", "start", UNIT]]
    assert "the steps after the failed step were not taken" in capsys.readouterr().err


def test_a_service_whose_user_cannot_be_made_starts_again_with_its_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    called = list[str]()

    def run(words: list[str]) -> "subprocess.CompletedProcess[bytes]":
        called.append(words[0])
        return subprocess.CompletedProcess(words, int(words[0] == "systemd-sysusers"))

    monkeypatch.setattr(subprocess, "run", run)
    installed = tmp_path / TARGET
    installed.parent.mkdir(parents=True)
    installed.write_text("old")
    live = _told(LIFT, Path("/"))
    live.dry_run = False
    assert carry_out(enable.steps(load(LIFT), tmp_path, []), live, keeps=UNIT) == 1
    assert called == ["systemctl", "systemctl", "systemd-sysusers", "systemctl"]
    assert installed.read_text() == "old"


@pytest.mark.parametrize("words", [["enable", str(LIFT)], ["disable", "lift_dry_contact"]])
def test_a_machine_without_systemd_is_told_and_not_changed(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(disable, "services", lambda root: {"lift_dry_contact"})
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(words) == 1
    *_, why, end = capsys.readouterr().err.splitlines()
    assert why == services.NO_SYSTEMD.format("systemctl")
    assert end == "the steps after the failed step were not taken"


def with_token(file: Path) -> Path:
    """Write the YAML of a door that needs a token. The door's name is the name of the file."""
    text = (CONFIG / "door_http.yaml").read_text().replace("side_door", file.stem)
    text = text.replace(
        "# token_file: /etc/rmf-bridges/relay.key", "token_file: /etc/rmf-bridges/relay.key"
    )
    file.write_text(text.replace("192.168.1.70", f"192.168.1.{len(file.stem)}"))
    return file


def test_a_secret_becomes_the_services_own(tmp_path: Path, calls: list[list[str]]) -> None:
    secret = tmp_path / "etc/rmf-bridges/relay.key"
    file = with_token(tmp_path / "ward.yaml")
    given = GiveSecret(secret, user_of("ward"))
    assert given not in list(enable.steps(load(file), tmp_path, []))
    secret.parent.mkdir(parents=True)
    secret.touch()
    assert given in list(enable.steps(load(file), tmp_path, []))
    secret.rename(secret.with_suffix(".old"))
    secret.symlink_to(secret.with_suffix(".old"))
    assert given not in list(enable.steps(load(file), tmp_path, []))


@pytest.mark.parametrize(("mode", "given"), [(0o600, True), (0o640, True), (0o644, False)])
def test_an_installed_file_that_not_everybody_may_read_becomes_the_services_own(
    tmp_path: Path, calls: list[list[str]], mode: int, given: bool
) -> None:
    installed = tmp_path / TARGET
    installed.parent.mkdir(parents=True)
    installed.write_bytes(LIFT.read_bytes())
    installed.chmod(mode)
    (tmp_path / "etc/passwd").write_text(f"{USER}:x:{os.geteuid()}:0::/:/usr/sbin/nologin\n")
    planned = list(enable.steps(load(installed), tmp_path, []))
    assert (GiveSecret(installed, USER) in planned) == given
    assert main(["enable", str(installed), "--root", str(tmp_path)]) == 0
    assert installed.stat().st_mode & 0o777 == mode


def test_two_services_cannot_have_one_secret(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = with_token(tmp_path / "ward.yaml"), with_token(tmp_path / "kitchen.yaml")
    assert main(["enable", str(first), "--root", str(tmp_path)]) == 0
    assert main(["enable", str(second), "--root", str(tmp_path)]) == os.EX_CONFIG
    told = capsys.readouterr().err
    wanted = f"/etc/rmf-bridges/relay.key is the secret of {tmp_path}/etc/rmf-bridges/ward.yaml too"
    assert f"{second}:15:17: {wanted}: give each service a copy" in told


def site(folder: Path) -> Path:
    """Copy a fleet's YAML and the two files of RMF to a new folder. Return the YAML."""
    folder.mkdir(parents=True)
    for name in ("robots_http.yaml", "fleet_tiny.yaml", "fleet_tiny_graph.yaml"):
        (folder / name).write_bytes((CONFIG / name).read_bytes())
    return folder / "robots_http.yaml"


def test_a_fleet_whose_files_would_be_missing_is_refused_before_the_first_step(
    tmp_path: Path, calls: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "root"
    root.mkdir()
    file = site(tmp_path / "site")
    assert main(["enable", str(file), "--root", str(root)]) == os.EX_CONFIG
    *told, advice = capsys.readouterr().err.splitlines()
    target = root / "etc/rmf-bridges"
    for line, name in {12: "fleet_tiny.yaml", 13: "fleet_tiny_graph.yaml"}.items():
        assert f"{target}/robots_http.yaml:{line}:3: {target}/{name} cannot be read" in told
    assert advice == enable.BESIDE
    assert (calls, list(root.iterdir())) == ([], [])


def test_a_fleet_is_enabled_with_its_files_beside_it_or_by_whole_paths(
    tmp_path: Path, calls: list[list[str]]
) -> None:
    beside, whole = tmp_path / "beside", tmp_path / "whole"
    site(beside / "etc/rmf-bridges")
    file = site(tmp_path / "site")
    assert main(["enable", str(file), "--root", str(beside)]) == 0
    site(whole / "srv")
    file.write_text(file.read_text().replace(" fleet_tiny", " /srv/fleet_tiny"))
    assert main(["enable", str(file), "--root", str(whole)]) == 0


def test_a_packages_upgrade_keeps_the_services_user(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = []
    (tmp_path / "etc").mkdir()
    for table in ("", f"{USER}:x:990:991::/:/usr/sbin/nologin\n"):
        (tmp_path / "etc/passwd").write_text(table)
        assert main(["enable", str(LIFT), "--drop-in", "--root", str(tmp_path)]) == 0
        printed.append(f"User={USER}\n" in capsys.readouterr().out)
    assert printed == [False, True]
