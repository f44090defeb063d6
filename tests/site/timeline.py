"""Virtual time, with a queue of future events."""

import heapq
from collections.abc import Callable
from functools import partial

NEVER = float("inf")
HOUR_S = 3600.0
EPOCH = 1_800_000_000.0
"""The wall clock at the day's beginning (s since the epoch)."""


class Timeline:
    """The clock of the day, with its events. `now` counts seconds from the beginning of the day.

    Two events with the same time happen in the order in which they were added.
    """

    def __init__(self) -> None:
        self.now = 0.0
        self._due: list[tuple[float, int, Callable[[], object]]] = []
        self._count = 0

    def at(self, when: float, what: Callable[[], object]) -> None:
        """Call `what` at this time. The time inf means never."""
        if when == NEVER:
            return
        self._count += 1
        heapq.heappush(self._due, (max(when, self.now), self._count, what))

    def after(self, seconds: float, what: Callable[[], object]) -> None:
        """Call `what` after this many seconds."""
        self.at(self.now + seconds, what)

    def next_at(self) -> float:
        """Return the time of the next event, or inf if there is no event."""
        return self._due[0][0] if self._due else NEVER

    def run(self, until: float) -> None:
        """Run all events until this time."""
        due = self._due
        while due and due[0][0] <= until:
            self.now, _, what = heapq.heappop(due)
            what()
        self.now = until


class Alarm:
    """The alarm clock of one party. It rings at the time of the latest `set`."""

    def __init__(self, timeline: Timeline, ring: Callable[[], None]) -> None:
        self._timeline = timeline
        self._ring = ring
        self._at = NEVER
        self._number = 0

    def set(self, at: float) -> None:
        """Ring at this time instead of the time set before."""
        if at == self._at:
            return
        self._at = at
        self._number += 1
        self._timeline.at(at, partial(self._rings, self._number))

    def ring_by(self, at: float) -> None:
        """Ring at this time, or earlier if that was set before."""
        self.set(min(at, self._at))

    def _rings(self, number: int) -> None:
        if number == self._number:
            self._at = NEVER
            self._ring()
