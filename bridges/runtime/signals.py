"""Signals: each one that would end or suspend a daemon makes it shut down, outputs off.

What counts is a signal's default action (signal(7)). Not caught: crashes, and SIGABRT from the
watchdog; such a process cannot be trusted any more, and `outputs-off` follows. SIGPIPE and SIGXFSZ stay
ignored, as Python sets them: an unread log or a full disk must not end a daemon, only fail the write.
SIGKILL and SIGSTOP cannot be caught.
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
"""Their default action neither ends nor suspends a process."""
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
    """Set permanently by the first signal that ends us. (A threading.Event cannot be used: a signal
    that came while its lock was held would wait forever.)
    """

    def __init__(self) -> None:
        """Catch the signals from now on; a SIGHUP ignored by the parent (nohup) stays ignored."""
        self._read, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        for number in ENDING:
            if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_signal)

    def wait(self, timeout_s: float) -> bool:
        """Wait up to `timeout_s`; True once a signal has come."""
        return bool(select.select([self._read], [], [], timeout_s)[0])

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        for each in TERMINAL:  # else a background job's last log lines would raise it again
            signal.signal(each, signal.SIG_IGN)
        with suppress(BlockingIOError):  # full of earlier ones
            os.write(self._write, b".")


def on_reset(reset: Callable[[], None]) -> None:
    """Call `reset` when an operator sends `rmf-bridge reset`."""
    signal.signal(RESET, lambda number, frame: reset())


def ignore() -> None:
    """Let only SIGKILL end this process, which runs briefly and switches outputs off."""
    for number in ENDING | {RESET}:
        signal.signal(number, signal.SIG_IGN)


def ignore_reset() -> None:
    """Ignore a reset until the daemon serves; by default the signal would end the process."""
    signal.signal(RESET, signal.SIG_IGN)
