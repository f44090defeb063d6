"""Two masters on one output: what reads back other than it was written, again and again.

A module that restarts once is written anew at once. Another master that writes the same coil would have
us switch a relay with it for ever. So after the second time the output is left alone for 1 s, and for
twice as long each time after, up to 30 s: meanwhile every write of its device fails with the fault's
name, and only what is safe is written, at once and as often as it takes.
"""

import math
from collections.abc import Callable, Iterable
from typing import Final

from drivers.hal import HalError

AGAIN_S: Final = 5.0
"""What comes later than this after a pause is not the same trouble."""
FIRST_S: Final = 1.0
LONGEST_S: Final = 30.0


class Rivals:
    """Which outputs somebody else writes too, by their names."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._pause_s: dict[str, float] = {}
        self._at: dict[str, float] = {}

    def contradicted(self, name: str) -> None:
        """It does not read as it was written."""
        now, before_s = self._now(), self._pause_s.get(name, 0.0)
        again = now - self._at.get(name, -math.inf) <= before_s + AGAIN_S
        self._at[name] = now
        self._pause_s[name] = min(max(FIRST_S, 2 * before_s), LONGEST_S) if again else 0.0

    def check(self, names: Iterable[str]) -> None:
        """Raises HalError for the first of these that another master has written just now."""
        for name in names:
            if self._now() - self._at.get(name, -math.inf) < self._pause_s.get(name, 0.0):
                raise HalError(
                    f"another master writes {name} too: it reads other than it was written, again and"
                    f" again; it is tried again after {self._pause_s[name]:g} s"
                )
