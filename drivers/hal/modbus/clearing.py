"""Calls (such as a lift's calls) that a controller takes and then clears. The daemon writes a call to a
place (a coil or register). Soon after the write the place reads "no call".

This file judges only places for calls. A place counts as one that its controller clears if every call
disappears within one scan. Another master that writes "no call" as quickly would look the same, so the
warning names both causes.

Everything else that contradicts the written value counts as another master's write (`Rivals` in
`lines.py`). Examples are a call that disappears later, a call that the daemon did not write, and any
other command.
"""

import logging
from collections.abc import Callable, Mapping
from typing import Final

from bridges.system.log import pairs
from drivers.hal.points import Clearing

log = logging.getLogger(__name__)

TWICE: Final = 2
"""The number of successive calls that must disappear within one scan. Then the place counts as one that
its controller clears. The driver writes the first of these calls again, because the module may have
restarted."""


class ClearedCalls:
    """The outputs whose calls a controller may clear. Each output has a name. `scan_s` is the period of
    readings (s)."""

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
        """Record a write. The reply to the write has come just now."""
        self._written_at[name] = self._now()
        self._stayed.discard(name)
        self._gone.discard(name)

    def may_read(self, name: str, written: int, found: int) -> bool:
        """Return whether the reading `found` fits the value `written`. It fits if both are equal, and
        also if the controller has only cleared the call in `written`."""
        cleared = name not in self._stayed and found == self._without_call(name, written)
        return found == written or cleared

    def keeps(self, name: str, written: int, found: int, asked_at: float) -> bool:
        """Return False if the driver must write the call again. The reading `found` must fit
        (`may_read`). The request for it was sent at `asked_at`.

        A call has stayed for a scan if a whole scan lies between the reply to its write and that
        request. On a slow line both take long, and the controller may clear the call between them.
        """
        habits = self._clearing.get(name)
        if habits is None or habits.pulse or self._without_call(name, written) == written:
            return True
        if found == written:
            if asked_at - self._written_at.get(name, 0.0) >= self._scan_s:
                self._stayed.add(name)
                self._in_a_row.pop(name, None)
            return True
        if name not in self._gone:
            self._gone.add(name)
            self._in_a_row[name] = self._in_a_row.get(name, 0) + 1
        return self._in_a_row[name] >= TWICE

    def tell(self, name: str, place: str) -> None:
        """Log a warning, once for each place, if what was written to the place twice disappeared."""
        if self._in_a_row.get(name, 0) >= TWICE and name not in self._told:
            self._told.add(name)
            text = (
                f"each call that the daemon writes to {place} disappears within a scan. If the"
                " controller takes the call and clears the place, write read_back: false at this"
                " command. Otherwise another master writes the place too"
            )
            log.warning(pairs("call_cleared", place=place, reason=text))

    def _without_call(self, name: str, written: int) -> int:
        """Return what the place reads after the controller has cleared the call in `written`."""
        bits = self._clearing[name].bits if name in self._clearing else 0
        return (written & ~bits) | (self._safe[name] & bits)
