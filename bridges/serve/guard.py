"""The guard of a daemon that was started by hand: it switches off what a kill -9 has left on.

A shell, since it only waits, in a session of its own, where neither Ctrl-C nor a closed terminal
reaches it. It reads a pipe that the daemon alone holds: a word on it says that the outputs are off,
its end without one that the daemon is dead. Under systemd the unit's ExecStopPost does this.
"""

import logging
import os
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress

from bridges.log import pairs

log = logging.getLogger(__name__)

SCRIPT = """
trap '' HUP INT QUIT TERM TSTP TTIN TTOU USR1 USR2
read -r word
[ "$word" = off ] && exit 0
"$@"
[ $? = 69 ] && sleep 1 && "$@"
"""
"""69: the dead daemon's lock was not free yet."""


class Guard:
    """`command`: what switches everything off."""

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
        """The outputs are off: it has nothing to do, and ends."""
        if self._shell is None or self._shell.stdin is None:
            return
        with suppress(OSError):
            self._shell.stdin.write(b"off\n")
            self._shell.stdin.close()
        self._shell.wait()


UNIT = ("NOTIFY_SOCKET", "RUNTIME_DIRECTORY", "RMF_BRIDGE_SERVICE")
"""What only a unit sets. (INVOCATION_ID is in a desktop's terminals as well.)"""


def needed(environ: Mapping[str, str] = os.environ) -> bool:
    """Whether no unit stands behind us, which would run `outputs-off` itself."""
    return not any(environ.get(name) for name in UNIT)
