"""What has come for the devices or subjects of one thread, and the bell that wakes it."""

import queue
import threading
from collections.abc import Hashable
from typing import Generic, TypeVar

INBOX_SIZE = 512
"""More events than this for one device between two scans are a flood: the oldest go, counted."""

T = TypeVar("T")


class Inbox(Generic[T]):
    """Every thread may put; the thread that serves takes.

    A request is a level, not a pulse: of several with the same `key` only the last one is kept, so that
    a flood of repeats costs a scan no more than one of them. What is kept stays in the order in which
    it came.
    """

    def __init__(self) -> None:
        self._items: dict[str, dict[Hashable, T]] = {}
        self._lock = threading.Lock()
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._rung = False
        self.dropped = 0
        self.closed = False

    def put(self, name: str, item: T, key: Hashable = None) -> None:
        """Add one event for a device and wake the thread. An event without a key replaces none."""
        with self._lock:
            waiting = self._items.setdefault(name, {})
            key = object() if key is None else key
            if waiting.pop(key, None) is None and len(waiting) == INBOX_SIZE:
                del waiting[next(iter(waiting))]
                self.dropped += 1
            waiting[key] = item
        self.wake()

    def wake(self) -> None:
        """Wake the thread without an event. A bell that rings already is not rung again."""
        if not self._rung:
            self._rung = True
            self._bell.put(None)

    def close(self) -> None:
        """No more rounds: the one under way ends as soon as it can."""
        self.closed = True
        self.wake()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the bell; False when the time is up first."""
        try:
            self._bell.get(timeout=max(0.0, timeout_s))
        except queue.Empty:
            return False
        self._rung = False
        return True

    def take(self) -> dict[str, list[T]]:
        """All events so far, by device, in order."""
        with self._lock:
            taken, self._items = self._items, {}
        return {name: list(waiting.values()) for name, waiting in taken.items()}
