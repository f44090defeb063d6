"""Converts seconds (float) to RMF's Time and Duration, and back."""

import math
from typing import Final

from bridges.messages.definitions import Duration, Time

ENDS: Final = 2**31
"""The first second (since the epoch) that does not fit into RMF's Time. Time counts seconds in 31 bits,
and ends on 2038-01-19."""


class ClockError(Exception):
    """Error for a wall clock that shows a later time than RMF's Time can hold."""


def stamp(wall: float) -> Time:
    """Convert seconds since the epoch to RMF's Time. A time before the epoch becomes 0, which means
    never. Raises ClockError."""
    if not wall < ENDS:
        raise ClockError(
            "the clock is past 2038-01-19, the last day that RMF's stamps can hold: set the clock"
        )
    fraction, seconds = math.modf(max(0.0, wall))
    return Time(sec=int(seconds), nanosec=int(fraction * 1e9))


def duration(seconds: float) -> Duration:
    """Convert seconds to RMF's Duration. The seconds may be negative."""
    whole = math.floor(seconds)
    return Duration(sec=whole, nanosec=int((seconds - whole) * 1e9))


def in_seconds(value: Time | Duration) -> float:
    """Convert a Duration to seconds, or a Time to seconds since the epoch."""
    return value.sec + value.nanosec * 1e-9
