"""Functions that make versions of our package with a defect. In one version no daemon starts. During
the installation of another version the machine becomes unreachable."""

from pathlib import Path
from typing import Final

from tests.deb.next_version import bridges_in

BROKEN: Final = 'raise SystemExit("this version cannot start")\n'
"""The statement with which the command `run` begins in the broken version. The version's command
`check` still works, so the package installs."""
CUT_OFF: Final = """
systemctl stop ssh.service
systemd-run --on-active=$(cat /run/cut-off-for) systemctl start ssh.service
pkill sshd
"""
"""The last lines of a package's postinst script. They end every ssh connection and stop the ssh server.
A timer starts the server again."""


def broken(tree: Path) -> None:
    """Change this tree so that no daemon starts."""
    with bridges_in(tree) as bridges:
        command = bridges / "commands/run.py"
        text = command.read_text()
        start = text.index("def run(")
        body = text.index("\n    ", start) + 1
        command.write_text(text[:body] + "    " + BROKEN + text[body:])


def cut_off(tree: Path) -> None:
    """Change this tree so that its installation ends every ssh connection."""
    script = tree / "DEBIAN/postinst"
    script.write_text(script.read_text() + CUT_OFF)
