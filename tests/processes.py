"""Find the processes that a test has left, and end all processes of a run that was killed."""

import os
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from typing import Final

RUN: Final = "TEST_RUN"
"""The environment variable that names the test run; every process started by the run has it."""
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
"""Wait until the run closes its end of the pipe, then kill the run's processes.

The guard of a killed daemon may have started another process meanwhile, so look again.
"""


def end_with_us() -> None:
    """End all later children of this process, and their children, when this process ends.

    This holds after SIGKILL too. PR_SET_PDEATHSIG would not do: its signal comes when the starting
    thread ends, and a child's own children do not inherit it.
    """
    if RUN in os.environ:
        return  # the run that started this worker ends the worker's processes
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
    """Return the command lines of all processes that have this directory among their arguments."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # the process has just ended
            line = path.read_bytes().decode(errors="replace")
            if str(directory) in line:
                found.append(line)
    return found
