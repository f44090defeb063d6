"""The shell completion and the manual page both come from the commands' parsers."""

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

FORKED = """
import os, sys
from bridges import cli
cli.whole_parser()
for told, line in zip(sys.argv[1::2], sys.argv[2::2]):
    if not (child := os.fork()):
        asked = {"_ARGCOMPLETE_STDOUT_FILENAME": told, "COMP_LINE": line, "COMP_POINT": str(len(line))}
        os.environ.update(asked)
        os.environ["_ARGCOMPLETE"] = "1"
        cli.main([])
    assert os.waitpid(child, 0)[1] == 0
"""
"""A program that completes each line in its own process, as a shell does. It forks after all
imports."""


def completed(folder: Path, *lines: str) -> list[list[str]]:
    """Return the words that argcomplete offers at the end of each line, by argcomplete's own
    protocol."""
    told = [folder / str(n) for n in range(len(lines))]
    words = [str(word) for each in zip(told, lines, strict=True) for word in each]
    environ = os.environ | {"_ARGCOMPLETE_IFS": "\n", "_ARGCOMPLETE_SHELL": "bash"}
    command = [sys.executable, "-c", FORKED, *words]
    subprocess.run(command, env=environ, check=True, capture_output=True)
    return [file.read_text().split() for file in told]


OFFERED = {
    "rmf-bridge ch": ["check"],
    "rmf-bridge run --log": ["--log-level", "--log-format"],
    "rmf-bridge fail lift.yaml car st": ["stuck"],
    "rmf-bridge send li": ["lift"],
}


def test_commands_options_and_choices_are_completed(tmp_path: Path) -> None:
    assert completed(tmp_path, *OFFERED) == list(OFFERED.values())


def test_the_names_of_the_devices_in_the_file_are_completed(tmp_path: Path) -> None:
    file = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"
    commands = ("press", "fail", "walk", "doctor", "log")
    lines = [f"rmf-bridge {command} {file} --device " for command in commands]
    assert completed(tmp_path, *lines) == [["Lift1"]] * len(commands)
    lines = [f"rmf-bridge {command} no_such.yaml --device " for command in commands]
    assert completed(tmp_path, *lines) == [[]] * len(commands)


def test_the_buttons_of_a_running_simulation_are_completed(tmp_path: Path) -> None:
    running = RealTime({"Lift1": LiftPlant("Lift1", shipped())})
    control = Control(tmp_path / "plant.sock", running.plants)
    try:
        press = f"rmf-bridge press --runtime-dir {tmp_path} lift.yaml fi"
        fail = f"rmf-bridge fail --runtime-dir {tmp_path} lift.yaml door_o"
        offered = [["fire_alarm"], ["door_open", "door_operator"]]
        assert completed(tmp_path, press, fail) == offered
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
