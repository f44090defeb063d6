"""Unreadable recordings. Every command gives the same exit code and prints a sentence."""

import os
from pathlib import Path

import pytest

from bridges import cli
from bridges.messages.releases import NEWEST
from tests.workbench.replay.written import write

READERS = (
    ("explain", "FILE"),
    ("plot", "FILE", "-o", "x.svg"),
    ("judge", "lift", "Lift1", "--recording", "FILE"),
    ("replay", "FILE"),
    ("page", "FILE"),
)
CONTENTS = {
    "empty": b"",
    "text": b"not a recording",
    "sqlite": b"SQLite format 3\0",
}
CUT = b"\x89MCAP0\r\n"
"""The first bytes of a recording that was cut off."""


def unreadable(sort: str, folder: Path) -> Path:
    file = folder / "x.mcap"
    match sort:
        case "missing":
            pass
        case "folder":
            file.mkdir()
        case "fifo":
            os.mkfifo(file)
        case _:
            file.write_bytes(CONTENTS[sort])
    return file


@pytest.mark.parametrize("command", READERS, ids=[command[0] for command in READERS])
@pytest.mark.parametrize("sort", ["missing", "folder", "fifo", *CONTENTS])
def test_what_is_no_recording_is_exit_66_and_a_sentence(
    command: tuple[str, ...], sort: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(unreadable(sort, tmp_path))
    assert cli.main([file if word == "FILE" else word for word in command]) == os.EX_NOINPUT
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith(f"rmf-bridge {command[0]}: ")
    assert "Traceback" not in told.err


@pytest.mark.parametrize(("command", "code"), [*zip(READERS[:4], (1, 1, 69, 66), strict=True)])
def test_a_recording_that_was_cut_is_read_as_far_as_it_goes(
    command: tuple[str, ...], code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every command reads the part before the cut. Only `replay` refuses the file, because the file's
    head is missing."""
    file = tmp_path / "x.mcap"
    file.write_bytes(CUT)
    assert cli.main([str(file) if word == "FILE" else word for word in command]) == code
    told = capsys.readouterr()
    assert (told.out, "Traceback" in told.err) == ("", False)


def test_a_recording_of_no_daemon_can_be_read_and_not_replayed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["replay", str(write(tmp_path / "bag", [], NEWEST))]) == os.EX_DATAERR
    assert "only these can be replayed" in capsys.readouterr().err


def test_every_command_that_reads_a_recording_is_here() -> None:
    takes = {
        path.stem
        for path in Path(cli.__file__).parents[1].glob("workbench/commands/*.py")
        if "BagError" in path.read_text(encoding="utf-8")
    }
    assert takes - {"recordings"} == {command[0] for command in READERS}
