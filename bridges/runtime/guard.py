"""The guard of a daemon that a person started by hand. If the daemon is killed (kill -9), the guard
switches its outputs off.

The guard is a shell process, because its only task is to wait. It has its own session, which neither
Ctrl-C nor a closed terminal reaches.

The guard reads a pipe, and only the daemon has the other end open. The daemon writes `off` into the
pipe when the outputs are off. If the pipe ends without this word, the daemon is dead. Under systemd no
guard is needed, because ExecStopPost switches the outputs off.
"""

import logging
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from bridges.system.log import pairs

log = logging.getLogger(__name__)

SCRIPT = f"""
trap '' HUP INT QUIT TERM TSTP TTIN TTOU USR1 USR2
read -r word
[ "$word" = off ] && exit 0
pause=5
again=
while [ $pause -le 60 ]; do
    "$@"
    case $? in
        1) sleep $pause; pause=$((pause + 5)) ;;
        {os.EX_UNAVAILABLE}) [ "$again" ] && exit; again=yes; sleep 1 ;;
        *) exit ;;
    esac
done
"""
"""The shell's program.

If `outputs-off` exits with 1, hardware does not answer. The program then repeats `outputs-off` for
minutes, with growing pauses, because nobody restarts this daemon.

If `outputs-off` exits with EX_UNAVAILABLE, another process still has the dead daemon's lock, or another
daemon serves now. Such a daemon switches the outputs off itself. Therefore the program repeats
`outputs-off` only once.
"""


def command(file: Path, runtime_dir: str | None) -> list[str]:
    """Return the command that switches off this process's outputs after its death."""
    given = ["--runtime-dir", os.path.abspath(runtime_dir)] if runtime_dir else []
    return [sys.executable, "-P", "-m", "bridges.cli", "outputs-off", str(file.absolute()), *given]


class Guard:
    """The running guard. `command`: the command that switches every output off."""

    def __init__(self, command: Sequence[str]) -> None:
        self._shell: subprocess.Popen[bytes] | None = None
        try:
            self._shell = subprocess.Popen(
                ["/bin/sh", "-c", SCRIPT, "rmf-bridge-guard", *command],
                stdin=subprocess.PIPE,
                start_new_session=True,
            )
        except OSError as error:
            log.warning(pairs("no_guard", reason=error))

    def dismiss(self) -> None:
        """End the guard, because the outputs are off."""
        if self._shell is None or self._shell.stdin is None:
            return
        with suppress(OSError):
            self._shell.stdin.write(b"off\n")
            self._shell.stdin.close()
        self._shell.wait()


UNIT = ("NOTIFY_SOCKET", "RUNTIME_DIRECTORY", "RMF_BRIDGE_SERVICE")
"""The variables that only a unit sets. INVOCATION_ID is not in the list, because a desktop's terminals
have it too."""


def needed(environ: Mapping[str, str] = os.environ) -> bool:
    """Return whether this daemon needs a guard. A daemon in a unit needs none, because the unit runs
    `outputs-off`."""
    return not any(environ.get(name) for name in UNIT)
