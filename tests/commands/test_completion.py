"""Completion in a shell, and the manual page: both are made from the commands' own parsers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bridges import cli
from bridges.commands.completion import SHELLS
from hal_fakes.control import Control
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.realtime import RealTime
from tests.hal_fakes.virtual_lift import shipped


def completed(line: str, tmp_path: Path) -> list[str]:
    """What the shell is offered at the end of this line, by argcomplete's own protocol."""
    told = tmp_path / "told"
    environ = os.environ | {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(told),
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_SHELL": "bash",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    command = [sys.executable, "-m", "bridges.cli"]
    subprocess.run(command, env=environ, check=True, capture_output=True)
    return told.read_text().split()


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("rmf-bridge ch", ["check"]),
        ("rmf-bridge run --log", ["--log-level", "--log-format"]),
        ("rmf-bridge fail lift.yaml car st", ["stuck"]),
        ("rmf-bridge send li", ["lift"]),
    ],
)
def test_commands_options_and_choices_are_completed(
    line: str, offered: list[str], tmp_path: Path
) -> None:
    assert completed(line, tmp_path) == offered


def test_the_devices_of_the_file_are_completed(tmp_path: Path) -> None:
    file = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"
    for command in ("press", "fail", "walk", "doctor", "log"):
        assert completed(f"rmf-bridge {command} {file} --device ", tmp_path) == ["Lift1"]
        assert completed(f"rmf-bridge {command} no_such.yaml --device ", tmp_path) == []


def test_the_buttons_of_a_running_simulation_are_completed(tmp_path: Path) -> None:
    running = RealTime({"Lift1": LiftPlant("Lift1", shipped())})
    control = Control(tmp_path / "plant.sock", running.plants)
    try:
        line = f"rmf-bridge press --runtime-dir {tmp_path} lift.yaml fi"
        assert completed(line, tmp_path) == ["fire_alarm"]
        line = f"rmf-bridge fail --runtime-dir {tmp_path} lift.yaml door_o"
        assert completed(line, tmp_path) == ["door_open", "door_operator"]
    finally:
        control.close()
        running.close()


@pytest.mark.parametrize("shell", SHELLS)
def test_each_shell_gets_a_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["completion", shell]) == 0
    assert "rmf-bridge" in capsys.readouterr().out


def test_the_manual_page_has_every_command_and_its_options() -> None:
    from argparse_manpage.manpage import Manpage  # type: ignore[import-untyped]

    page = str(Manpage(cli.whole_parser()))
    for name in cli.COMMANDS:
        assert f"rmf-bridge {name}".replace("-", "\\-") in page
    assert "\\-\\-log\\-format" in page
