"""Handles signals. Many signals by default end or suspend a process. On each of these signals, a daemon
switches its outputs off and ends.

Two sorts of signals are not caught: those of a crash, and the SIGABRT of systemd's watchdog. After them
the process cannot be trusted, so `outputs-off` runs after its death.

SIGPIPE and SIGXFSZ are ignored, which is Python's default. So an unread log or a full disk does not end
a daemon. SIGKILL and SIGSTOP cannot be caught.
"""

import os
import select
import signal
from contextlib import suppress
from types import FrameType
from typing import Final

CRASHES: Final = {
    signal.SIGABRT,
    signal.SIGBUS,
    signal.SIGFPE,
    signal.SIGILL,
    signal.SIGSEGV,
    signal.SIGSYS,
    signal.SIGTRAP,
}
HARMLESS: Final = {signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH}
"""The signals that by default neither end nor suspend a process."""
WRITES: Final = {signal.SIGPIPE, signal.SIGXFSZ}
RESET: Final = signal.SIGUSR1
PIPE_BYTES: Final = 1 << 16
"""The size of a pipe in Linux."""
TERMINAL: Final = {signal.SIGTTIN, signal.SIGTTOU}

ENDING: Final = frozenset(signal.valid_signals()) - {
    *CRASHES,
    *HARMLESS,
    *WRITES,
    RESET,
    signal.SIGKILL,
    signal.SIGSTOP,
}


class End:
    """A flag that the first signal of ENDING sets for good. A threading.Event would not do, because it
    could hang if a signal arrives while the event's lock is held."""

    def __init__(self) -> None:
        """Begin to catch the signals. If the parent process ignores SIGHUP (nohup), the daemon ignores
        it too."""
        self._read, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        for number in ENDING:
            if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_signal)

    def wait(self, timeout_s: float, orders: "Orders | None" = None) -> bool:
        """Wait up to `timeout_s` (s). Return True after a signal. An order in `orders` ends the wait
        early, and the result is then False."""
        watched = [self._read, *([orders.read] if orders else [])]
        return self._read in select.select(watched, [], [], timeout_s)[0]

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        for each in TERMINAL:  # in the background, a log line would raise these signals again
            signal.signal(each, signal.SIG_IGN)
        with suppress(BlockingIOError):  # a full pipe already has signals
            os.write(self._write, b".")


class Orders:
    """The signal RESET, which announces a person's order (`bridges/runtime/order.py`).

    The handler only writes to a pipe, because a second signal may interrupt the handler, and any lock
    may be held. `read` is the pipe's end that becomes readable after a signal.
    """

    def __init__(self) -> None:
        """Begin to catch the signal."""
        self.read, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.signal(RESET, self._on_signal)

    def announced(self) -> bool:
        """Return whether a signal has come since the last call."""
        try:
            # before the caller looks for orders, so that none is missed
            os.read(self.read, PIPE_BYTES)
        except BlockingIOError:
            return False
        return True

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        with suppress(BlockingIOError):  # so many signals have come already
            os.write(self._write, b".")


def ignore() -> None:
    """Ignore every signal that can be ignored. Only a short-lived process that switches outputs off
    calls this."""
    for number in ENDING | {RESET}:
        signal.signal(number, signal.SIG_IGN)


def ignore_reset() -> None:
    """Ignore the signal RESET until the daemon serves. By default RESET would end the process."""
    signal.signal(RESET, signal.SIG_IGN)
