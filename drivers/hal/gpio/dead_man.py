"""A dead-man: a thread that watches a loop. When the loop's scans stop, the dead-man switches the
outputs to their safe level. The outputs keep this level.

The dead-man writes outputs from another thread, so it is only for GPIO. No thread can interrupt a
Modbus client, so Modbus modules have their own watchdog. If some thread never releases Python's global
interpreter lock, the dead-man cannot run either. In this case systemd's watchdog acts.
"""

import threading
import time
from collections.abc import Callable

AFTER_S = 2.0


class GpioDeadMan:
    """A thread that calls `drop` once when `fed` has not been called for AFTER_S seconds."""

    def __init__(
        self, drop: Callable[[], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._drop = drop
        self._clock = clock
        self._fed_at: float | None = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def fed(self) -> None:
        """Report a finished scan. The dead-man watches from the first scan on."""
        self._fed_at = self._clock()
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="dead-man", daemon=True)
            self._thread.start()

    def check(self) -> bool:
        """Switch the outputs to their safe level if the last scan finished more than AFTER_S seconds
        ago. Return whether this call did so."""
        overdue = self._fed_at is not None and self._clock() - self._fed_at > AFTER_S
        if overdue:
            self._fed_at = None
            self._drop()
        return overdue

    def close(self) -> None:
        """Stop watching."""
        self._ended.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(self._left_s()):
            self.check()

    def _left_s(self) -> float:
        """Return the time (s) that is left until the next scan must have finished."""
        fed_at = self._fed_at
        return AFTER_S if fed_at is None else max(fed_at + AFTER_S - self._clock(), 0.01)
