"""Events waiting for the devices or subjects of one thread, and the bell that wakes it."""

import queue
import threading
from collections.abc import Hashable
from typing import Generic, TypeVar

INBOX_SIZE = 512
"""More events for one device between two scans are a flood: the oldest are dropped and counted."""

MOST_NAMES = 2000
"""More devices than anybody serves. Further names are made up, and dropped."""

T = TypeVar("T")


class Inbox(Generic[T]):
    """Every thread may put; the thread that serves takes.

    A request is a level, not a pulse: of several with the same `key` only the last one is kept, so that
    a flood of repeats costs a scan no more than one of them. Events stay in order of arrival.
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
            if len(self._items) >= MOST_NAMES and name not in self._items:
                self.dropped += 1
                return
            waiting = self._items.setdefault(name, {})
            key = object() if key is None else key
            if waiting.pop(key, None) is None and len(waiting) == INBOX_SIZE:
                del waiting[next(iter(waiting))]
                self.dropped += 1
            waiting[key] = item
        self.wake()

    def wake(self) -> None:
        """Wake the thread without an event; does nothing if the bell already rings."""
        if not self._rung:
            self._rung = True
            self._bell.put(None)

    def close(self) -> None:
        """Ask for no more rounds; the current one ends as soon as it can."""
        self.closed = True
        self.wake()

    def wait(self, timeout_s: float) -> bool:
        """Wait for the bell; False after `timeout_s`."""
        try:
            self._bell.get(timeout=max(0.0, timeout_s))
        except queue.Empty:
            return False
        self._rung = False
        return True

    def waiting(self) -> set[str]:
        """The devices that have events waiting."""
        with self._lock:
            return set(self._items)

    def take_for(self, name: str) -> list[T]:
        """Take the events waiting for one device, in order."""
        with self._lock:
            return list(self._items.pop(name, {}).values())

    def take(self) -> dict[str, list[T]]:
        """Take all waiting events: by device, in order."""
        with self._lock:
            taken, self._items = self._items, {}
        return {name: list(waiting.values()) for name, waiting in taken.items()}
