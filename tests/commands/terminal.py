"""A terminal with a person who types, for commands that ask questions."""

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
    """A terminal with a person who types."""

    def __init__(self, *words: str | Path, environ: Mapping[str, str] = os.environ) -> None:
        self.screen = b""
        self.pid, self._end = pty.fork()
        if self.pid == 0:
            command = [sys.executable, "-m", "bridges.cli", *map(str, words)]
            os.execve(sys.executable, command, {**environ, "TERM": "xterm"})
        fcntl.ioctl(self._end, termios.TIOCSWINSZ, struct.pack("HHHH", 60, 120, 0, 0))

    def wait_for(self, text: str) -> None:
        """Wait until the screen has shown this text."""
        self.wait_until(lambda: text.encode() in self.screen, text)

    def wait_until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until the condition holds. Meanwhile read the screen, because an unread program stops
        drawing."""
        deadline = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline, (what, self.screen[-2000:])
            if select.select([self._end], [], [], 0.02)[0]:
                self._read()

    def _read(self) -> None:
        try:
            chunk = os.read(self._end, 65536)
        except OSError as error:  # Linux raises this error after the end of the program
            raise AssertionError(f"the program has ended: {self.screen[-2000:]!r}") from error
        self.screen += chunk
        if b"\x1b[6n" in chunk:  # the program asks for the position of the cursor
            os.write(self._end, b"\x1b[1;1R")

    def type(self, keys: str) -> None:
        os.write(self._end, keys.encode())

    def close(self) -> None:
        """Close the terminal, as when an ssh connection ends."""
        os.close(self._end)

    def wait(self) -> int:
        """Return the exit code, or the negative number of the signal. After this call nobody reads the
        screen."""
        _, status = os.waitpid(self.pid, 0)
        return os.waitstatus_to_exitcode(status)

    def end(self) -> int:
        code = self.wait()
        os.close(self._end)
        return code
