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
from collections.abc import Callable
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

    def wait(self, timeout_s: float) -> bool:
        """Wait up to `timeout_s` (s). Return True after a signal."""
        return bool(select.select([self._read], [], [], timeout_s)[0])

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        for each in TERMINAL:  # in the background, a log line would raise these signals again
            signal.signal(each, signal.SIG_IGN)
        with suppress(BlockingIOError):  # a full pipe already has signals
            os.write(self._write, b".")


def on_reset(reset: Callable[[], None]) -> None:
    """Call `reset` at the signal that announces a person's order (`bridges/runtime/order.py`)."""
    signal.signal(RESET, lambda number, frame: reset())


def ignore() -> None:
    """Ignore every signal that can be ignored. Only a short-lived process that switches outputs off
    calls this."""
    for number in ENDING | {RESET}:
        signal.signal(number, signal.SIG_IGN)


def ignore_reset() -> None:
    """Ignore the signal RESET until the daemon serves. By default RESET would end the process."""
    signal.signal(RESET, signal.SIG_IGN)
