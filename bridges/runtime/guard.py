"""The guard of a daemon started by hand. It switches off the outputs that a kill -9 leaves on.

The guard is a shell, because it only waits. It has a session of its own, which neither Ctrl-C nor a
closed terminal reaches. It reads a pipe whose other end only the daemon has open. A word from the pipe
means that the outputs are off. If the pipe ends without a word, the daemon is dead. Under systemd,
ExecStopPost takes the guard's place.
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
"""The shell's program. After exit code 1 (hardware does not answer) it repeats `outputs-off` for
minutes with growing pauses, because nobody restarts this daemon. After EX_UNAVAILABLE it repeats
`outputs-off` once: either the dead daemon's lock was not free yet, or another daemon serves now and
switches the outputs off."""


def command(file: Path, runtime_dir: str | None) -> list[str]:
    """Return the command that switches off the outputs that this process may leave on."""
    given = ["--runtime-dir", os.path.abspath(runtime_dir)] if runtime_dir else []
    return [sys.executable, "-P", "-m", "bridges.cli", "outputs-off", str(file.absolute()), *given]


class Guard:
    """The guard, while it runs. `command`: the command that switches every output off."""

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
"""Variables that only a unit sets. (INVOCATION_ID is left out, because a desktop's terminals have it
too.)"""


def needed(environ: Mapping[str, str] = os.environ) -> bool:
    """Return whether this daemon needs a guard. It does if no unit runs `outputs-off` for it."""
    return not any(environ.get(name) for name in UNIT)
