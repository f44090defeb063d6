"""Where the runtime's time comes from, and when what is told each second is told next."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from bridges.core.durations import AGES_AGO
from bridges.rmf import stamps
from bridges.rmf.definitions import Time

TELL_EVERY_S = 1.0
TELL_GAP_S = 0.1
"""What is told goes out at 1 Hz, and at once when it changes, but never faster than 10 Hz."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Monotonic seconds for durations, seconds since the epoch for stamps; tests bring their own."""

    monotonic: Callable[[], float]
    wall: Callable[[], float]

    def stamp(self, read_at: float | None) -> Time:
        """When a reading was taken, on the wall clock as it is now; 0 for never.

        The age is monotonic, so that a step of the wall clock bends neither age nor order.
        """
        if read_at is None:
            return Time()
        return stamps.stamp(self.wall() - (self.monotonic() - read_at))


def machine_s() -> float:
    """Seconds since the machine's start, its sleep among them."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class Pace:
    """When to tell something that is told each second and at once when it has changed."""

    def __init__(self) -> None:
        self.told_at = AGES_AGO
        self._told: object = None

    def due_at(self, news: object) -> float:
        """When this is to be told (monotonic s)."""
        return self.told_at + (TELL_EVERY_S if news == self._told else TELL_GAP_S)

    def told(self, news: object, now: float) -> None:
        """It has been told."""
        self._told, self.told_at = news, now
