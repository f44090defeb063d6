"""The clocks of a daemon, and the times at which it publishes a message. A state is published each
second, and at once after a change."""

from collections.abc import Callable

from msgspec import Struct

from bridges.kinds.shared.durations import AGES_AGO
from bridges.messages import stamps
from bridges.messages.definitions import Time

TELL_EVERY_S = 1.0
TELL_GAP_S = 0.1
"""The minimum time (s) between two published states, however often the state changes."""


class Clock(Struct, frozen=True):
    """The two clocks of a daemon: `monotonic` (s) for durations, `wall` (s since the epoch) for
    stamps."""

    monotonic: Callable[[], float]
    wall: Callable[[], float]

    def stamp(self, read_at: float | None) -> Time:
        """Return the stamp of a reading from the time `read_at` (monotonic s). Return 0 if `read_at` is
        None, because nothing was read.

        The stamp is the wall clock's present time minus the reading's age by the monotonic clock. So a
        step of the wall clock changes neither the age nor the order of readings. Raises ClockError if
        the wall clock is past 2038.
        """
        if read_at is None:
            return Time()
        return stamps.stamp(self.wall() - (self.monotonic() - read_at))


class PublishPace:
    """The times at which one message is published: each second, and at once after a change of its
    content."""

    def __init__(self) -> None:
        self.told_at = AGES_AGO
        self._told: object = None

    def due_at(self, news: object, *, at_once: bool = False) -> float:
        """Return the time (monotonic s) at which the content `news` must be published. `at_once`:
        publish before the next second, even if `news` has not changed."""
        unchanged = news == self._told and not at_once
        return self.told_at + (TELL_EVERY_S if unchanged else TELL_GAP_S)

    def published(self, news: object, now: float) -> None:
        """Note that `news` was published."""
        self._told, self.told_at = news, now
