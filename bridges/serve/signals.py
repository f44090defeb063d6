"""Signals: whatever would end or suspend a daemon ends it in good order, its outputs off.

The rule is by what a signal does to a process that has not asked for it (signal(7)). Left alone:
a crash, and SIGABRT, which is the watchdog's: the process can be trusted no more, and `outputs-off`
follows. SIGPIPE and SIGXFSZ stay ignored, as Python has them: they come from a log that nobody reads
or a full disk, which end no daemon; the write fails. SIGKILL and SIGSTOP cannot be caught.
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
"""By default nothing ends or stops when they come."""
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
    """Set for good by the first signal that ends us. (A threading.Event is not to be set by a signal:
    one that came while its lock was held would wait for ever.)
    """

    def __init__(self) -> None:
        """From now on; a SIGHUP that the starter ignores (nohup) stays ignored."""
        self._read, self._write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        for number in ENDING:
            if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._on_signal)

    def wait(self, timeout_s: float) -> bool:
        """Wait for it this long (s); True once it has come."""
        return bool(select.select([self._read], [], [], timeout_s)[0])

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        for each in TERMINAL:  # else the last lines of a job in the background would raise it again
            signal.signal(each, signal.SIG_IGN)
        with suppress(BlockingIOError):  # full of earlier ones
            os.write(self._write, b".")


def on_reset(reset: Callable[[], None]) -> None:
    """Call `reset` when an operator sends `rmf-bridge reset`."""
    signal.signal(RESET, lambda number, frame: reset())


def ignore() -> None:
    """Nothing but SIGKILL ends this process before it has finished: it is short, and switches off."""
    for number in ENDING | {RESET}:
        signal.signal(number, signal.SIG_IGN)


def ignore_reset() -> None:
    """A reset does no harm before anybody serves, nor while another program replaces this one."""
    signal.signal(RESET, signal.SIG_IGN)
