"""The loop: one thread that owns one bus and the devices on it.

RMF callbacks and GPIO edges only put something into the inbox. The loop waits on the inbox until the
next device is due, scans it, and makes every output safe before it ends, however it ends.
"""

import logging
import math
import queue
import threading
from collections.abc import Sequence
from typing import Any

from bridges.log import pairs
from bridges.serve.device import Clock, Node
from drivers.hal import Bus

log = logging.getLogger(__name__)

INBOX_SIZE = 512
"""More events than this for one device between two scans are a flood: the oldest go, counted."""

LEAST_GAP_S = 0.001
"""Time alone never asks for scans faster than this."""

Item = tuple[str, Any]


class Inbox:
    """Events for the devices of one loop; any thread may put, the loop's thread takes.

    A request is a level, not a pulse: of several with the same `key` only the last one is kept, in
    the place of the first, so that a flood of repeats costs a scan no more than one of them.
    """

    def __init__(self) -> None:
        self._items: dict[str, dict[Any, Any]] = {}
        self._lock = threading.Lock()
        self._bell: queue.SimpleQueue[None] = queue.SimpleQueue()
        self._rung = False
        self.dropped = 0

    def put(self, item: Item, key: Any = None) -> None:
        """Add one event for a device and wake the loop. An event without a key replaces none."""
        device, event = item
        with self._lock:
            waiting = self._items.setdefault(device, {})
            key = object() if key is None else key
            if key not in waiting and len(waiting) == INBOX_SIZE:
                del waiting[next(iter(waiting))]
                self.dropped += 1
            waiting[key] = event
        self.wake()

    def wake(self) -> None:
        """Wake the loop without an event. A bell that rings already is not rung again."""
        if not self._rung:
            self._rung = True
            self._bell.put(None)

    def wait(self, timeout_s: float) -> bool:
        """Wait for the bell; False when the time is up first."""
        try:
            self._bell.get(timeout=max(0.0, timeout_s))
        except queue.Empty:
            return False
        self._rung = False
        return True

    def take(self) -> dict[str, list[Any]]:
        """All events so far, by device, in order."""
        with self._lock:
            taken, self._items = self._items, {}
        return {device: list(waiting.values()) for device, waiting in taken.items()}


class Loop:
    """Scans the nodes of one bus. `scans` counts finished rounds, for the watchdog."""

    def __init__(
        self, name: str, bus: Bus, nodes: Sequence[Node], scan_s: float, clock: Clock
    ) -> None:
        self.name = name
        self.nodes = nodes
        self.inbox = Inbox()
        self.scans = 0
        self.safe = False
        self._bus = bus
        self._scan_s = scan_s
        self._clock = clock
        self._due = dict.fromkeys((node.name for node in nodes), -math.inf)
        self._edge = False
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=f"bus-{name}", daemon=True)

    def start(self) -> None:
        """Begin to scan."""
        self._bus.on_edge(self._on_edge)
        self._thread.start()

    def stop(self, timeout_s: float) -> bool:
        """End after the scan under way, outputs off; False if it does not end, or not safely."""
        self._stopping = True
        self.inbox.wake()
        self._thread.join(timeout_s)
        return not self._thread.is_alive() and self.safe

    @property
    def alive(self) -> bool:
        """False when it has ended, by stop or by a defect of ours."""
        return self._thread.is_alive()

    @property
    def ready(self) -> bool:
        """Every device has been tried once and its first state is out."""
        return all(node.ready for node in self.nodes)

    def _on_edge(self) -> None:
        self._edge = True
        self.inbox.wake()

    def _run(self) -> None:
        try:
            while not self._stopping:
                self._round()
        finally:
            self._bus.insist()
            safe = [node.make_safe() for node in self.nodes]
            for node in self.nodes:
                node.close()
            self._bus.close()
            self.safe = all(safe)
            log.info(pairs("outputs_off", bus=self.name, verified=self.safe))

    def _round(self) -> None:
        self.inbox.wait(min(self._due.values()) - self._clock.monotonic())
        events = self.inbox.take()
        everything, self._edge = self._edge, False
        for node in self.nodes:
            if self._stopping:
                return
            due = self._clock.monotonic() >= self._due[node.name]
            if due or everything or node.name in events:
                started = self._clock.monotonic()
                node.scan(events.get(node.name, ()))
                next_at = min(node.wake_at, started + self._scan_s)
                self._due[node.name] = max(next_at, started + LEAST_GAP_S)
        self.scans += 1
        self._bus.scanned()
