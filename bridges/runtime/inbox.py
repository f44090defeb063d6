"""The inbox of one thread. It holds events for the devices or subjects that the thread serves, and
wakes the thread."""

import queue
import threading
from collections.abc import Hashable
from typing import Generic, TypeVar

INBOX_SIZE = 512
"""The maximum number of events for one device between two scans. In a flood the oldest events are
dropped and counted."""

MOST_NAMES = 2000
"""The maximum number of names with events. No site has more devices, so somebody must have invented
further names. Their events are dropped."""

T = TypeVar("T")


class Inbox(Generic[T]):
    """An inbox. Any thread puts events in, and the serving thread takes them out.

    A new event replaces a waiting event with the same `key`. Nothing is lost, because a request states
    what the requester wants, and only its last request counts. So a flood of repeats costs a scan only
    one event. Events keep the order of their arrival.
    """

    def __init__(self) -> None:
        self._items: dict[str, dict[Hashable, T]] = {}
        self._lock = threading.Lock()
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._rung = False
        self.dropped = 0
        self.closed = False

    def put(self, name: str, item: T, key: Hashable = None) -> None:
        """Add an event for a device, and wake the thread. An event without a key replaces no event."""
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
        """Wake the thread, even if there is no event. Do nothing if the thread has been woken
        already."""
        if not self._rung:
            self._rung = True
            self._bell.put(None)

    def close(self) -> None:
        """Ask the thread to end. The present round ends early if possible."""
        self.closed = True
        self.wake()

    def wait(self, timeout_s: float) -> bool:
        """Wait until the thread is woken. Return False if `timeout_s` has passed without this."""
        try:
            self._bell.get(timeout=max(0.0, timeout_s))
        except queue.Empty:
            return False
        self._rung = False
        return True

    def waiting(self) -> set[str]:
        """Return the devices with waiting events."""
        with self._lock:
            return set(self._items)

    def take_for(self, name: str) -> list[T]:
        """Take the waiting events of one device, in order."""
        with self._lock:
            return list(self._items.pop(name, {}).values())

    def take(self) -> dict[str, list[T]]:
        """Take all waiting events, by device and in order."""
        with self._lock:
            taken, self._items = self._items, {}
        return {name: list(waiting.values()) for name, waiting in taken.items()}
