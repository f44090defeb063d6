"""`rmf-bridge log`: its command line for journalctl, and the lines that its search pattern finds."""

import argparse
import os
import re
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from bridges import cli
from bridges.commands import log
from bridges.runtime.runtime_directory import RuntimeDirectory
from bridges.system.directories import by_hand
from bridges.system.log import pairs

LINES = [
    pairs("state", device="Lift1", mode="AGV"),
    pairs("state", device="Lift10", mode="AGV"),
    pairs("fault", device="Lift1", code="OVERLOAD"),
    pairs("fault_over", device="Lift1", code="OVERLOAD"),
    pairs("fault", device='the "east" lift', code="OVERLOAD"),
]


def command(*words: str) -> list[str]:
    parser = argparse.ArgumentParser()
    log.add_arguments(parser)
    return log.command(parser.parse_args(words))


def test_log_asks_the_journal_for_the_unit_of_this_file() -> None:
    assert command("config/lift_a.yaml", "-f", "-n", "5", "--since", "today") == [
        "journalctl",
        "--unit=rmf-bridge@lift_a.service",
        "--lines=5",
        "--output=short-iso",
        "--no-hostname",
        "--follow",
        "--since=today",
    ]


@pytest.mark.parametrize("name", ["my.lift", "config/my.lift.yaml", "/etc/my.lift.yml"])
def test_a_service_may_have_a_dot_in_its_name(name: str) -> None:
    assert command(name)[1] == "--unit=rmf-bridge@my.lift.service"


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (("--event", "fault"), [2, 4]),
        (("--device", "Lift1"), [0, 2, 3]),
        (("--device", 'the "east" lift'), [4]),
        (("--event", "state", "--device", "Lift1"), [0]),
        (("--event", "f.*t"), []),
    ],
)
def test_log_finds_only_lines_about_this_event_or_device(
    words: tuple[str, ...], found: list[int]
) -> None:
    (grep,) = [word for word in command("lift_a.yaml", *words) if word.startswith("--grep=")]
    pattern = re.compile(grep.removeprefix("--grep="))
    assert [i for i, line in enumerate(LINES) if pattern.search(line)] == found


def test_a_daemon_that_was_started_by_hand_has_its_log_where_it_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "run"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    file = tmp_path / "lift_by_hand.yaml"
    with closing(RuntimeDirectory(by_hand(file), file, serves=True)):
        assert cli.main(["log", str(file)]) == 69
    assert capsys.readouterr().err == (
        "lift_by_hand was started by hand: its log is on the terminal where it runs, or where"
        f" `rmf-bridge run {file} 2> LOG` sends it\n"
    )


def test_an_unknown_service_is_reported_before_the_lines_of_the_journal(tmp_path: Path) -> None:
    journal = tmp_path / "journalctl"
    journal.write_text("#!/bin/sh\necho asked for $1\n")
    journal.chmod(0o755)
    told = subprocess.run(
        [sys.executable, "-m", "bridges.cli", "log", "no_such_lift"],
        env={**os.environ, "PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stderr.startswith("no_such_lift is not a service here (services: ")
    assert told.stdout == "asked for --unit=rmf-bridge@no_such_lift.service\n"
