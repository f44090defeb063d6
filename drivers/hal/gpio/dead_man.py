"""The dead-man beside a loop: outputs drop when its scans stop, and stay dropped.

It works where an output can be written from another thread: on GPIO. (A Modbus client cannot be
pre-empted; its module has a watchdog of its own. A thread that holds Python's lock stops this one
too; systemd's watchdog is behind it.)
"""

import threading
import time
from collections.abc import Callable

AFTER_S = 2.0


class DeadMan:
    """Calls `drop` once, from its own thread, when `fed` has not been called for AFTER_S seconds."""

    def __init__(
        self, drop: Callable[[], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._drop = drop
        self._clock = clock
        self._fed_at: float | None = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def fed(self) -> None:
        """A scan has finished. The first one starts the watch."""
        self._fed_at = self._clock()
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="dead-man", daemon=True)
            self._thread.start()

    def check(self) -> bool:
        """Drop if it is time to; True when it was."""
        overdue = self._fed_at is not None and self._clock() - self._fed_at > AFTER_S
        if overdue:
            self._fed_at = None
            self._drop()
        return overdue

    def close(self) -> None:
        """Watch no more."""
        self._ended.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(AFTER_S / 8):
            self.check()
