"""Finds outputs that another master writes too. If nobody noticed this, the two masters would switch a
relay to and fro for ever."""

import math
from collections.abc import Callable, Iterable
from typing import Final

from drivers.hal.points import HalError

AGAIN_S: Final = 5.0
"""The time (s) after a pause during which a further contradiction begins the next pause. A later
contradiction counts as the first one, which causes no pause. A contradiction is a reading that
differs from the written value."""
FIRST_S: Final = 1.0
LONGEST_S: Final = 30.0
"""The shortest pause (FIRST_S) and the longest pause (LONGEST_S) in seconds. During a pause the daemon
does not write an output that another master writes too."""


class Rivals:
    """The outputs, by name, that another master seems to write too. The reading of such an output
    contradicts the value that the daemon has written, again and again.

    After the first contradiction the daemon writes the output again at once, because the module may
    have restarted. If there is another master, repeated writes would switch the relay to and fro for
    ever. So after the second contradiction the daemon does not write the output for 1 s. Each further
    pause is twice as long, up to 30 s. During a pause every write of the device fails with an error
    that names the fault. Only safe values are an exception: the daemon writes them at once and every
    time.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._pause_s: dict[str, float] = {}
        self._at: dict[str, float] = {}

    def contradicted(self, name: str) -> None:
        """Record that this output has contradicted its written value."""
        now, before_s = self._now(), self._pause_s.get(name, 0.0)
        again = now - self._at.get(name, -math.inf) <= before_s + AGAIN_S
        self._at[name] = now
        self._pause_s[name] = min(max(FIRST_S, 2 * before_s), LONGEST_S) if again else 0.0

    def check(self, names: Iterable[str]) -> None:
        """Raise HalError during the pause of one of these outputs. The error names the first such
        output."""
        for name in names:
            if self._now() - self._at.get(name, -math.inf) < self._pause_s.get(name, 0.0):
                raise HalError(
                    f"another master writes {name} too: its readings contradict the written values;"
                    f" the next write is after {self._pause_s[name]:g} s"
                )
