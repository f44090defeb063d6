"""Calls that a controller takes and then clears by itself: their places read "no call" soon after.

Only the places of calls are judged here. A place clears itself if it loses the value of each written
call within a scan. Nobody can tell such a controller from another master that writes "no call" as
quickly, so the warning names both. Every other contradiction is another master's (`Rivals` in
`lines.py`): a call that is lost later, another call than the written one, and any other command.
"""

import logging
from collections.abc import Callable, Mapping
from typing import Final

from bridges.system.log import pairs
from drivers.hal.points import Clearing

log = logging.getLogger(__name__)

TWICE: Final = 2
"""After so many calls in a row that were lost within a scan, the place clears itself. The first lost
call is written again, because the module may have restarted."""


class ClearedCalls:
    """The places, by name, that may clear a written call. `scan_s`: the period of readings (s)."""

    def __init__(
        self,
        now: Callable[[], float],
        scan_s: float,
        safe: Mapping[str, int],
        clearing: Mapping[str, Clearing],
    ) -> None:
        self._now = now
        self._scan_s = scan_s
        self._safe = safe
        self._clearing = clearing
        self._written_at: dict[str, float] = {}
        self._stayed: set[str] = set()
        self._gone: set[str] = set()
        self._in_a_row: dict[str, int] = {}
        self._told: set[str] = set()

    def wrote(self, name: str) -> None:
        """Record a write."""
        self._written_at[name] = self._now()
        self._stayed.discard(name)
        self._gone.discard(name)

    def may_read(self, name: str, written: int, found: int) -> bool:
        """Is this reading the written value, or that value without its call?"""
        cleared = name not in self._stayed and found == self._without_call(name, written)
        return found == written or cleared

    def keeps(self, name: str, written: int, found: int) -> bool:
        """Judge a reading for which `may_read` is true; return False if the call must be written
        again."""
        habits = self._clearing.get(name)
        if habits is None or habits.pulse or self._without_call(name, written) == written:
            return True
        if found == written:
            if self._now() - self._written_at.get(name, 0.0) >= self._scan_s:
                self._stayed.add(name)
                self._in_a_row.pop(name, None)
            return True
        if name not in self._gone:
            self._gone.add(name)
            self._in_a_row[name] = self._in_a_row.get(name, 0) + 1
        return self._in_a_row[name] >= TWICE

    def tell(self, name: str, place: str) -> None:
        """Log once that this place clears itself."""
        if self._in_a_row.get(name, 0) >= TWICE and name not in self._told:
            self._told.add(name)
            text = (
                f"{place} loses each written call within a scan: a controller that takes the call"
                " clears its place, so write read_back: false at this command; or another master"
                " writes the place too"
            )
            log.warning(pairs("call_cleared", place=place, reason=text))

    def _without_call(self, name: str, written: int) -> int:
        """Return the value of a place that has cleared its call."""
        bits = self._clearing[name].bits if name in self._clearing else 0
        return (written & ~bits) | (self._safe[name] & bits)
