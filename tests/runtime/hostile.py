"""Obstacles to switching a relay off: a dead bus, and a user who waits for every lock."""

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from tests.runtime.site import SERVICE

NOBODY: Final = 65534
WAITS: Final = f"""
import fcntl, os, sys, threading
os.setgroups([])
os.setgid({NOBODY})
os.setuid({NOBODY})
for path in sys.argv[1:]:
    try:
        file = os.open(path, os.O_RDONLY)
    except PermissionError:
        continue
    threading.Thread(target=fcntl.flock, args=(file, fcntl.LOCK_EX), daemon=True).start()
    print(os.path.basename(path))
print("waits", flush=True)
sys.stdin.read()
"""
"""A program that opens each readable file among its arguments, and waits for the lock of each file."""


@contextmanager
def group_member(folder: Path) -> Iterator[list[str]]:
    """Let a member of the directory's group wait for all locks in the directory.

    Yield the files that the member could open.
    """
    files = sorted(str(path) for path in folder.iterdir() if path.is_file())
    with subprocess.Popen(
        [sys.executable, "-c", WAITS, *files],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as member:
        assert member.stdout
        yield [line.strip() for line in iter(member.stdout.readline, "waits\n")]
        member.kill()


def unit(run: Path, invocation: str) -> dict[str, str]:
    """Return the environment variables that systemd sets for one run of a unit."""
    return {"RUNTIME_DIRECTORY": str(run), "INVOCATION_ID": invocation, **SERVICE}


def with_a_dead_bus_first(yaml: str, port: int, timeout_s: float = 1.5) -> str:
    """Return a door's YAML, with another door in front. The bus of the other door is at `port` and
    never answers."""
    bus = f"{{type: modbus, tcp: {{host: 127.0.0.1, port: {port}}}, timeout_s: {timeout_s}}}"
    door = yaml.partition("doors:\n")[2]
    far = door.replace("ward_door:", "far_door:\n    bus: dead")
    text = re.sub(r"(?m)^buses:\n", f"buses:\n  dead: {bus}\n", yaml)
    return text.replace("doors:\n", f"doors:\n{far}").replace(
        "ward_door:", "ward_door:\n    bus: module"
    )


def live_before_dead(log: str) -> bool:
    """Return whether the log reports the live bus (`module`) as switched off before it reports the dead
    bus."""
    before, _, live = log.partition("outputs_off bus=module verified=yes")
    return bool(live) and "outputs_off bus=dead" not in before
