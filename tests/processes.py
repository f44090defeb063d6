"""Functions that find the processes which a test has left behind, and end all processes of a killed
test run."""

import os
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from typing import Final

RUN: Final = "TEST_RUN"
"""The environment variable with the name of the test run. Every process of the run inherits the
variable."""
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
"""A shell program that waits until the test run closes the pipe. Then it kills the processes of the
run.

It looks for processes several times, because a killed daemon's guard may have started another process.
"""


def end_with_us() -> None:
    """Let all later children and grandchildren of this process end when this process ends.

    The children also end when this process dies from SIGKILL. PR_SET_PDEATHSIG would not suffice, for
    two reasons. It already sends its signal when the thread that started the child ends. And
    grandchildren do not inherit the setting.
    """
    if RUN in os.environ:
        return  # this is a worker of a run that ends the worker's processes itself
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
    """Return the command lines of all processes with this directory among their arguments."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # the process has ended in the meantime
            line = path.read_bytes().decode(errors="replace")
            if str(directory) in line:
                found.append(line)
    return found
