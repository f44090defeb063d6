"""Virtual time: what is to happen, in order."""

import heapq
from collections.abc import Callable
from functools import partial

NEVER = float("inf")
EPOCH = 1_800_000_000.0
"""The wall clock when the day begins (s)."""


class Timeline:
    """`now` in seconds since the day began. Of two things at the same time the older is first."""

    def __init__(self) -> None:
        self.now = 0.0
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._count = 0

    def at(self, when: float, what: Callable[[], None]) -> None:
        """Let this happen then; never, if that is inf."""
        if when == NEVER:
            return
        self._count += 1
        heapq.heappush(self._due, (max(when, self.now), self._count, what))

    def after(self, seconds: float, what: Callable[[], None]) -> None:
        """Have this happen so many seconds from now."""
        self.at(self.now + seconds, what)

    def run(self, until: float) -> None:
        """Everything that happens until then."""
        due = self._due
        while due and due[0][0] <= until:
            self.now, _, what = heapq.heappop(due)
            what()
        self.now = until


class Alarm:
    """One party's clock: the last time that was set is when it rings."""

    def __init__(self, timeline: Timeline, ring: Callable[[], None]) -> None:
        self._timeline = timeline
        self._ring = ring
        self._at = NEVER
        self._number = 0

    def set(self, at: float) -> None:
        """Ring at this time, instead of the time set before."""
        if at == self._at:
            return
        self._at = at
        self._number += 1
        self._timeline.at(at, partial(self._rings, self._number))

    def _rings(self, number: int) -> None:
        if number == self._number:
            self._at = NEVER
            self._ring()
