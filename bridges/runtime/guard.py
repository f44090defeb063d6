"""The guard of a daemon that was started by hand: it switches off what a kill -9 has left on.

It is a shell, because it only waits, in its own session, where neither Ctrl-C nor a closed terminal
reaches it. It reads a pipe that only the daemon holds. A word on the pipe means that the outputs are
off; the end of the pipe without a word, that the daemon is dead. Under systemd, ExecStopPost does this.
"""

import logging
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from bridges.host.log import pairs

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
"""`outputs-off` ends with 1 while hardware does not answer: it is tried for some minutes, ever more
seldom, for nobody starts this daemon again. EX_UNAVAILABLE: the dead daemon's lock was not free yet, or
another daemon serves now, which switches off what was left on: one more try."""


def command(file: Path, runtime_dir: str | None) -> list[str]:
    """The command that switches off what this process may leave on."""
    given = ["--runtime-dir", os.path.abspath(runtime_dir)] if runtime_dir else []
    return [sys.executable, "-P", "-m", "bridges.cli", "outputs-off", str(file.absolute()), *given]


class Guard:
    """The running guard. `command`: switches everything off."""

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
        """The outputs are off: end the guard."""
        if self._shell is None or self._shell.stdin is None:
            return
        with suppress(OSError):
            self._shell.stdin.write(b"off\n")
            self._shell.stdin.close()
        self._shell.wait()


UNIT = ("NOTIFY_SOCKET", "RUNTIME_DIRECTORY", "RMF_BRIDGE_SERVICE")
"""Variables that only a unit sets. (INVOCATION_ID is also set in a desktop's terminals.)"""


def needed(environ: Mapping[str, str] = os.environ) -> bool:
    """Whether this daemon needs a guard: no unit would run `outputs-off` for it."""
    return not any(environ.get(name) for name in UNIT)
