"""Makers of versions that fail. In one version no daemon starts. Another version cuts the machine
off."""

from pathlib import Path
from typing import Final

from tests.deb.next_version import bridges_in

BROKEN: Final = 'raise SystemExit("this version cannot start")\n'
"""The text of the command `run` in the broken version. Its `check` works, so the package installs."""
CUT_OFF: Final = """
systemctl stop ssh.service
systemd-run --on-active=$(cat /run/cut-off-for) systemctl start ssh.service
pkill sshd
"""
"""The end of a postinst. After this script nobody reaches the machine for a while."""


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
