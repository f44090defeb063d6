"""The clocks of a daemon, and the pace of publishing: each second, and at once after a change."""

import time
from collections.abc import Callable

from msgspec import Struct

from bridges.kinds.shared.durations import AGES_AGO
from bridges.messages import stamps
from bridges.messages.definitions import Time

TELL_EVERY_S = 1.0
TELL_GAP_S = 0.1
"""The least time (s) between two states. A state is published each second, and at once when it
changes."""


class Clock(Struct, frozen=True):
    """Two clocks: `monotonic` (s) for durations, `wall` (s since the epoch) for stamps."""

    monotonic: Callable[[], float]
    wall: Callable[[], float]

    def stamp(self, read_at: float | None) -> Time:
        """Return the stamp of a reading taken at `read_at` (monotonic s); 0 if `read_at` is None, which
        means no reading.

        The stamp is the wall clock's present time minus the reading's age by the monotonic clock. So a
        step of the wall clock distorts neither age nor order. Raises ClockError if the wall clock is
        past 2038.
        """
        if read_at is None:
            return Time()
        return stamps.stamp(self.wall() - (self.monotonic() - read_at))


def machine_s() -> float:
    """Return the seconds since the machine's start. The time that the machine slept is included."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class PublishPace:
    """Decides when to publish something: each second, and at once when it has changed."""

    def __init__(self) -> None:
        self.told_at = AGES_AGO
        self._told: object = None

    def due_at(self, news: object, *, at_once: bool = False) -> float:
        """Return the time to publish `news` (monotonic s). `at_once`: even if nothing has changed."""
        unchanged = news == self._told and not at_once
        return self.told_at + (TELL_EVERY_S if unchanged else TELL_GAP_S)

    def published(self, news: object, now: float) -> None:
        """Note that `news` was published."""
        self._told, self.told_at = news, now
