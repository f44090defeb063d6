"""Versions that fail: one whose daemons cannot start, and one that cuts the machine off."""

from pathlib import Path
from typing import Final

from tests.deb.next_version import bridges_in

BROKEN: Final = 'raise SystemExit("this version cannot start")\n'
"""The program `run` of the broken version. `check` still works, so that the package installs."""
CUT_OFF: Final = """
systemctl stop ssh.service
systemd-run --on-active=$(cat /run/cut-off-for) systemctl start ssh.service
pkill sshd
"""
"""The end of a postinst after which nobody reaches the machine for a while."""


def broken(tree: Path) -> None:
    """Let no daemon start."""
    with bridges_in(tree) as bridges:
        command = bridges / "commands/run.py"
        text = command.read_text()
        start = text.index("def run(")
        body = text.index("\n    ", start) + 1
        command.write_text(text[:body] + "    " + BROKEN + text[body:])


def cut_off(tree: Path) -> None:
    """End every connection by ssh while the package is installed."""
    script = tree / "DEBIAN/postinst"
    script.write_text(script.read_text() + CUT_OFF)
