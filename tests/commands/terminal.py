"""A terminal with somebody who types at it, for commands that ask."""

import fcntl
import os
import pty
import select
import struct
import sys
import termios
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from tests.waiting import PATIENCE_S


class Terminal:
    """A terminal with somebody who types at it."""

    def __init__(self, *words: str | Path, environ: Mapping[str, str] = os.environ) -> None:
        self.screen = b""
        self.pid, self._end = pty.fork()
        if self.pid == 0:
            command = [sys.executable, "-m", "bridges.cli", *map(str, words)]
            os.execve(sys.executable, command, {**environ, "TERM": "xterm"})
        fcntl.ioctl(self._end, termios.TIOCSWINSZ, struct.pack("HHHH", 60, 120, 0, 0))

    def wait_for(self, text: str) -> None:
        """Until the screen has shown this."""
        self.wait_until(lambda: text.encode() in self.screen, text)

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        """Until it holds, reading what the program draws: one that nobody reads stops drawing."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline, (what, self.screen[-2000:])
            if select.select([self._end], [], [], 0.02)[0]:
                self._read()

    def _read(self) -> None:
        try:
            chunk = os.read(self._end, 65536)
        except OSError as error:  # Linux says so when the program has ended
            raise AssertionError(f"it has ended: {self.screen[-2000:]!r}") from error
        self.screen += chunk
        if b"\x1b[6n" in chunk:  # it asks where the cursor is
            os.write(self._end, b"\x1b[1;1R")

    def type(self, keys: str) -> None:
        os.write(self._end, keys.encode())

    def close(self) -> None:
        """The terminal is closed, as when an ssh connection ends."""
        os.close(self._end)

    def wait(self) -> int:
        """The exit code, or minus the signal, without reading the screen any more."""
        _, status = os.waitpid(self.pid, 0)
        return os.waitstatus_to_exitcode(status)

    def end(self) -> int:
        code = self.wait()
        os.close(self._end)
        return code
