"""A bus's backoff after failures. The pause doubles from 0.5 s to a longest pause, and the first
success ends it."""

import math
from collections.abc import Callable
from typing import Final

from drivers.hal.points import HalError

BACKOFF_FIRST_S: Final = 0.5
BACKOFF_MAX_S: Final = 30.0
JITTER: Final = 0.2
"""The largest part of a pause that is cut off at random. Because of the cut, many daemons do not call
at the same moment."""


class Backoff:
    """The pauses after failures. `jitter()` returns a random number between 0 and 1. `most_s`: the
    longest pause (s)."""

    def __init__(
        self,
        clock: Callable[[], float],
        jitter: Callable[[], float],
        most_s: float = BACKOFF_MAX_S,
    ) -> None:
        self._clock = clock
        self._jitter = jitter
        self._most_s = most_s
        self._pause_s = 0.0
        self._retry_at = -math.inf
        self._failure = ""
        self._insisted = False
        self.proven = False
        """Has an attempt ever succeeded?"""

    @property
    def insisting(self) -> bool:
        """Return whether the next attempt ignores the pause."""
        return self._insisted

    @property
    def failing(self) -> bool:
        """Has the last attempt failed?"""
        return self._pause_s > 0

    @property
    def probing(self) -> bool:
        """Return whether the next attempt only tests if a failure is over. After `insist` it is a
        normal attempt."""
        return self.failing and not self._insisted

    def check(self, not_yet: bool = False) -> None:
        """Raise HalError with the last failure's text while the pause runs. If `not_yet` is True, raise
        it even without a pause."""
        if self._clock() < self._retry_at or not_yet:
            raise HalError(self._failure)

    def failed(self, text: str) -> HalError:
        """Begin a pause that is twice as long as the last pause. Return the HalError for the caller to
        raise."""
        self._failure = text
        self._pause_s = min(max(2 * self._pause_s, BACKOFF_FIRST_S), self._most_s)
        self._retry_at = self._clock() + self._pause_s * (1 - JITTER * self._jitter())
        return HalError(text)

    def mended(self) -> None:
        """Record a success. The success ends the pause, and makes the next pause the shortest."""
        self._pause_s, self._retry_at, self._insisted = 0.0, -math.inf, False
        self.proven = True

    def insist(self) -> None:
        """Let one attempt skip the pause. Further calls have no effect until an attempt succeeds."""
        if not self._insisted:
            self._insisted, self._retry_at = True, -math.inf
