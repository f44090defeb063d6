"""The loader reads a key of an earlier version, and warns. `migrate` rewrites the key in the file."""

import errno
import os
import tempfile
from argparse import Namespace
from pathlib import Path

import msgspec
import pytest
import yaml

from bridges import __version__, cli
from bridges.commands import migrate
from bridges.settings import renamed_keys
from bridges.settings.load import load
from bridges.settings.renamed_keys import RENAMED, RenamedKey
from drivers.charger.can_frames import frame_map
from tests.commands.test_backup import as_nobody
from tests.settings.reading import RIGHT, problems_of
from workbench.commands.schema import markdown

ROOT = Path(__file__).parents[2]
WIFERION = ROOT / "drivers/profiles/wiferion.yaml"
HEAD = """\
kind: charger
driver: can_frames
buses:
  can: {type: can, slcan: {port: /dev/ttyACM0, bitrate: 500000}}
chargers:
"""
BAY = """\
  bay1:   # beside the window
    # the map, as of the first commissioning
    setpoints: {max_volts: 29.4, volts: 29.2, amps: 30}
    map:
      stops_unfed_s: 2   # asked of the maker
"""
MAP = "".join(
    f"    {line}\n" if line else "\n"
    for line in WIFERION.read_text().partition("map:\n")[2].splitlines()
)


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """Return a charger's file in the form of the first version, with the old key in its `map`."""
    file = tmp_path / "bay.yaml"
    file.write_text(HEAD + BAY + MAP)
    return file


def rewritten(file: Path) -> str:
    assert cli.main(["migrate", str(file)]) == 0
    return file.read_text()


def test_an_old_key_is_read_in_its_present_place_with_a_warning_at_its_line(old: Path) -> None:
    config = load(old)
    assert config.devices["bay1"].limits.peer_internal_timeout_s == 2
    here = "write chargers: {bay1: {limits: {peer_internal_timeout_s: 2}}}"
    text = f"{old}:10:7: warning: 'stops_unfed_s' has a new name: {here} (rmf-bridge migrate {old})"
    assert text in map(str, config.warnings)


def test_check_says_what_to_write_and_accepts_the_file(
    old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["check", str(old)]) == 0
    assert "'stops_unfed_s' has a new name: write" in capsys.readouterr().err


def test_a_service_that_starts_logs_its_old_keys(
    old: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(
        "RMF_BRIDGE_FITS", "nothing"
    )  # as in a unit without a drop-in: then `run` ends at once
    assert cli.main(["run", str(old)]) == os.EX_CONFIG
    told = capsys.readouterr().err
    assert told.count("has a new name") == 1
    assert f"WARNING {old}:10:7: 'stops_unfed_s' has a new name: write chargers: {{bay1: " in told


def test_migrate_moves_the_key_and_keeps_every_comment(old: Path) -> None:
    before = load(old)
    new = BAY.replace("      stops_unfed_s: 2   # asked of the maker\n", "").replace(
        "    setpoints",
        "    limits: {peer_internal_timeout_s: 2}   # asked of the maker\n    setpoints",
    )
    assert rewritten(old) == HEAD + new + MAP
    after = load(old)
    assert after.devices == before.devices
    others = [w.text for w in before.warnings if "has a new name" not in w.text]
    assert [w.text for w in after.warnings] == others


def test_a_rewritten_file_is_not_changed_again(
    old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = rewritten(old)
    capsys.readouterr()
    assert rewritten(old) == first
    assert capsys.readouterr().out == f"{old} has no old key\n"


@pytest.mark.parametrize(
    ("limits", "becomes"),
    [
        ("    limits: {misses: 4}\n", "    limits: {peer_internal_timeout_s: 2, misses: 4}\n"),
        (
            "    limits:\n      misses: 4\n",
            "    limits:\n      peer_internal_timeout_s: 2   # asked of the maker\n      misses: 4\n",
        ),
    ],
)
def test_an_existing_section_gets_the_key(old: Path, limits: str, becomes: str) -> None:
    old.write_text(HEAD + BAY.replace("    map:", f"{limits}    map:") + MAP)
    assert becomes.replace("   # asked of the maker", "") in rewritten(old).replace(
        "   # asked of the maker", ""
    )
    assert load(old).devices["bay1"].limits.misses == 4


@pytest.mark.parametrize("place", ["first", "last"])
def test_a_key_in_braces_is_cut_out_with_its_comma(old: Path, place: str) -> None:
    whole = msgspec.to_builtins(
        frame_map(load(ROOT / "config/charger_wiferion.yaml").devices["charger_c"])
    )
    written = yaml.safe_dump(whole, default_flow_style=True, width=10_000).strip()
    inner = written[1:-1]
    both = f"stops_unfed_s: 2, {inner}" if place == "first" else f"{inner}, stops_unfed_s: 2"
    head = HEAD + BAY.partition("    map:")[0]
    old.write_text(f"{head}    map: {{{both}}}   # all of it\n")
    assert rewritten(old).endswith(f"    map: {{{inner}}}   # all of it\n")


def test_a_key_whose_value_is_an_alias_is_left_to_a_person(
    old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    anchor = "    limits: {start_timeout_s: &two 2}\n"
    text = HEAD + BAY.replace("    map:", f"{anchor}    map:").replace("_s: 2  ", "_s: *two  ")
    old.write_text(text + MAP)
    assert cli.main(["migrate", str(old)]) == os.EX_DATAERR
    told = capsys.readouterr().err
    assert (
        f"{old} must be changed by hand: line 11 takes its value from the anchor (&) on line 9"
        in told
    )
    assert old.read_text() == text + MAP


def test_a_file_with_crlf_keeps_it_on_each_line(old: Path) -> None:
    old.write_bytes((HEAD + BAY + MAP).replace("\n", "\r\n").encode())
    rewritten(old)
    lines = old.read_bytes().split(b"\n")
    assert [line for line in lines[:-1] if not line.endswith(b"\r")] == []
    assert b"    limits: {peer_internal_timeout_s: 2}   # asked of the maker\r" in lines


def test_both_names_together_are_refused_at_the_old_name(old: Path) -> None:
    text = HEAD + BAY.replace("    map:", "    limits: {peer_internal_timeout_s: 3}\n    map:")
    wrong = "'stops_unfed_s' is the old name of 'peer_internal_timeout_s', which the file has too"
    assert problems_of(old, text + MAP) == [f"11:7: {wrong}: delete it"]
    assert cli.main(["migrate", str(old)]) == os.EX_CONFIG


def test_a_wrong_value_of_an_old_key_is_refused_at_its_place(old: Path) -> None:
    text = HEAD + BAY.replace("stops_unfed_s: 2", "stops_unfed_s: soon")
    (problem,) = problems_of(old, text + MAP)
    assert problem.startswith("10:22: 'peer_internal_timeout_s' is the text 'soon'")


def test_a_dry_run_prints_the_difference_and_writes_nothing(
    old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = old.read_bytes()
    assert cli.main(["migrate", str(old), "--dry-run"]) == 0
    changed = [line for line in capsys.readouterr().out.splitlines() if line[0] in "+-"][2:]
    assert changed == [
        "+    limits: {peer_internal_timeout_s: 2}   # asked of the maker",
        "-      stops_unfed_s: 2   # asked of the maker",
    ]
    assert old.read_bytes() == before


def test_the_file_keeps_its_mode_and_its_link(old: Path) -> None:
    old.chmod(0o640)
    link = old.with_name("link.yaml")
    link.symlink_to(old)
    rewritten(link)
    assert link.is_symlink()
    assert old.stat().st_mode & 0o777 == 0o640
    assert "stops_unfed_s" not in old.read_text()


def test_a_secret_file_is_never_readable_by_others_while_it_is_rewritten(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old.chmod(0o600)
    left = old.with_name(f".{old.name}.new")
    left.touch(0o644)  # of an interrupted run
    sync, modes = os.fsync, list[int]()

    def note(opened: int) -> None:
        modes.append(os.fstat(opened).st_mode & 0o777)
        sync(opened)

    monkeypatch.setattr(os, "fsync", note)
    rewritten(old)
    assert modes[0] == 0o600
    assert not left.exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
def test_a_user_who_may_not_keep_the_files_owner_changes_nothing(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with tempfile.TemporaryDirectory(dir="/tmp") as public:  # nobody cannot reach pytest's folders
        os.chown(public, 65534, 65534)
        file = Path(public) / "bay.yaml"
        file.write_text(HEAD + BAY + MAP)
        before = (file.read_bytes(), file.stat().st_uid, file.stat().st_mode)
        load(file)  # nobody may not read modules that are loaded later
        args = Namespace(file=file, dry_run=False)
        assert as_nobody(lambda: migrate.run(args)) == os.EX_CANTCREAT
        assert capfd.readouterr().err == f"{file} cannot be written: {os.strerror(errno.EPERM)}\n"
        assert (file.read_bytes(), file.stat().st_uid, file.stat().st_mode) == before
        assert list(Path(public).iterdir()) == [file]


def test_a_section_that_two_devices_share_by_an_alias_is_changed_once(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = RenamedKey("gates.*.limits.opening_s", "gates.*.limits.open_s", "1.2.0")
    monkeypatch.setattr(renamed_keys, "RENAMED", (row,))
    north, south = RIGHT.replace("limits: {", "limits: &l {"), RIGHT.partition("  north:\n")[2]
    for place, other in (("A0", "A4"), ("1A", "A5"), ("A2", "A6")):
        south = south.replace(f"point: {place}", f"point: {other}")
    south = "  south:\n" + south.partition("    limits:")[0] + "    limits: *l\n"
    file.write_text((north + south).replace("open_s: 3", "opening_s: 3"))
    assert [gate.limits.open_s for gate in load(file).devices.values()] == [3, 3]
    assert rewritten(file) == north + south


def test_a_key_that_shares_its_line_must_be_changed_by_hand(
    old: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = HEAD + BAY.partition("    map:")[0] + "    ? map\n    : stops_unfed_s: 2\n" + MAP
    old.write_text(text)
    assert load(old).devices["bay1"].limits.peer_internal_timeout_s == 2
    assert cli.main(["migrate", str(old)]) == os.EX_DATAERR
    assert old.read_text() == text
    assert "must be changed by hand" in capsys.readouterr().err


def test_a_key_with_only_a_new_name_keeps_its_place(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = RenamedKey("gates.*.limits.opening_s", "gates.*.limits.open_s", "1.2.0")
    monkeypatch.setattr(renamed_keys, "RENAMED", (row,))
    file.write_text(RIGHT.replace("open_s: 3", "opening_s: 3"))
    assert load(file).devices["north"].limits.open_s == 3
    assert rewritten(file) == RIGHT


def test_a_key_at_the_top_and_a_whole_section_can_be_renamed(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = RenamedKey("wires", "buses", "1.2.0")
    monkeypatch.setattr(renamed_keys, "RENAMED", (row,))
    file.write_text(RIGHT.replace("buses:", "wires:"))
    assert list(load(file).buses) == ["header"]
    assert rewritten(file) == RIGHT


@pytest.mark.parametrize("row", RENAMED, ids=lambda row: row.was)
def test_each_row_is_of_this_or_the_last_major_version_and_its_new_key_exists(
    row: RenamedKey,
) -> None:
    assert int(row.since.split(".")[0]) >= int(__version__.split(".")[0]) - 1, "delete the row"
    known = markdown()
    assert f"`{row.now.split('.')[-1]}`" in known
    assert f"`{row.was.split('.')[-1]}`" not in known


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_of_another_editor_is_rewritten_too(old: Path, mark: str, end: str) -> None:
    text = mark + (HEAD + BAY + MAP).replace("\n", end)
    old.write_bytes(text.encode())
    before = load(old).devices
    assert cli.main(["migrate", str(old)]) == 0
    after = old.read_bytes().decode()
    assert after.startswith(mark)
    assert "stops_unfed_s" not in after
    assert after.count(f"{end}    map:{end}") == 1
    assert load(old).devices == before
