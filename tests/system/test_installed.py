"""Commands of an installation without the package `workbench`. The daemons' commands work. Other
commands name the missing package.

`tests/deb/test_apart.py` checks the texts from our Debian packages.
"""

import subprocess
import sys

import pytest

ALONE = (
    "import sys; sys.modules['workbench'] = None; from bridges.cli import main; sys.exit(main())"
)
LACKS = "not installed: in the git clone of rmf-bridges run .venv/bin/pip install .\n"


def alone(*words: str) -> subprocess.CompletedProcess[str]:
    """Run `rmf-bridge WORDS` in an environment that has only the daemons."""
    return subprocess.run([sys.executable, "-c", ALONE, *words], capture_output=True, text=True)


@pytest.mark.parametrize("command", ["run", "check", "incident"])
def test_a_command_of_the_daemons_needs_no_workbench(command: str) -> None:
    done = alone(command, "--help")
    assert (done.returncode, done.stderr) == (0, "")


def test_a_command_that_is_not_installed_says_what_to_install() -> None:
    done = alone("watch", "--localhost")
    assert (done.returncode, done.stdout) == (69, "")
    assert done.stderr == f"rmf-bridge watch: {LACKS}"


def test_an_incident_cannot_be_made_anonymous_and_nothing_is_written() -> None:
    done = alone("incident", "lift.yaml", "--anonymous")
    assert (done.returncode, done.stdout) == (69, "")
    assert done.stderr == f"rmf-bridge incident: {LACKS}"
