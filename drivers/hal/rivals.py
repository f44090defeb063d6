"""Finds outputs that another master writes too, so that no relay is switched to and fro for ever."""

import math
from collections.abc import Callable, Iterable
from typing import Final

from drivers.hal.points import HalError

AGAIN_S: Final = 5.0
"""A contradiction later than this (s) after a pause counts as the first contradiction."""
FIRST_S: Final = 1.0
LONGEST_S: Final = 30.0
"""The first and the longest pause (s) in writing an output that another master writes too."""


class Rivals:
    """The outputs, by name, that another master writes too: each repeatedly contradicts its written
    value.

    After the first contradiction the output is written again at once: the module may have restarted.
    With another master, repeated writes would switch the relay to and fro for ever. So after the second
    contradiction the output is left alone for 1 s, then for twice as long each time, up to 30 s.
    Meanwhile every write of its device fails, with an error that names the fault. Only safe values are
    still written, at once and every time.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._pause_s: dict[str, float] = {}
        self._at: dict[str, float] = {}

    def contradicted(self, name: str) -> None:
        """Record that this output contradicts its written value."""
        now, before_s = self._now(), self._pause_s.get(name, 0.0)
        again = now - self._at.get(name, -math.inf) <= before_s + AGAIN_S
        self._at[name] = now
        self._pause_s[name] = min(max(FIRST_S, 2 * before_s), LONGEST_S) if again else 0.0

    def check(self, names: Iterable[str]) -> None:
        """Raise HalError for the first of these outputs that is left alone now."""
        for name in names:
            if self._now() - self._at.get(name, -math.inf) < self._pause_s.get(name, 0.0):
                raise HalError(
                    f"another master writes {name} too: its readings contradict the written values;"
                    f" the next write is after {self._pause_s[name]:g} s"
                )
