"""A plain `pip install` installs every file. The installed commands start even without an extra."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WITHOUT_MCAP = "import sys; sys.modules['mcap'] = None; from bridges.cli import main; main()"


def test_every_file_that_is_not_a_module_is_installed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())
    data = settings["tool"]["setuptools"]["package-data"]
    installed = {
        file for name, globs in data.items() for glob in globs for file in (ROOT / name).glob(glob)
    }
    there = {
        file
        for name in ("bridges", "drivers", "hal_fakes", "workbench")
        for file in (ROOT / name).rglob("*")
        if file.is_file() and file.suffix not in (".py", ".pyc")
    }
    assert there - installed == set()


@pytest.mark.parametrize("command", ["explain", "judge", "plot", "page", "replay", "recorder"])
def test_a_command_starts_without_the_library_of_recordings(command: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_MCAP, command, "--help"], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
