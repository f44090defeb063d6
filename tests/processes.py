"""Which processes a test has left, and the end of all that a killed run has left."""

import os
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from typing import Final

RUN: Final = "TEST_RUN"
"""Whatever is started by a run of the tests has its name under this name in its environment."""
REAPER: Final = """
read -r _
for round in 1 2 3 4 5 6 7 8 9 10; do
    found=$(grep -slaF "$0" /proc/[0-9]*/environ) || [ "$found" ] || exit
    for one in $found; do
        one=${one#/proc/}
        kill -KILL "${one%/environ}"
    done
done
"""
"""Waits for the end of the run, which holds the other end of its pipe. A killed daemon's guard may have
started another process meanwhile: so it looks again."""


def end_with_us() -> None:
    """Whatever this process starts from now on, and what that starts, ends with it, also by SIGKILL.

    PR_SET_PDEATHSIG would not do: it is told when the thread that started a child ends, and is not
    inherited by the child's own children.
    """
    if RUN in os.environ:
        return  # a worker's processes end with the run that it is of
    os.environ[RUN] = f"{os.getpid()}-{token_hex(8)}"
    waits, _ = os.pipe()
    os.posix_spawn(
        "/bin/sh",
        ["sh", "-c", REAPER, f"{RUN}={os.environ[RUN]}"],
        {"PATH": "/usr/bin:/bin"},
        file_actions=[
            (os.POSIX_SPAWN_DUP2, waits, 0),
            *((os.POSIX_SPAWN_OPEN, out, os.devnull, os.O_WRONLY, 0) for out in (1, 2)),
        ],
        setsid=True,
    )
    os.close(waits)


def running(directory: Path) -> list[str]:
    """The command lines of all processes that were told of this directory."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has just ended
            line = path.read_bytes().decode(errors="replace")
            if str(directory) in line:
                found.append(line)
    return found
