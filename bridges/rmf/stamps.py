"""Between RMF's Time and Duration and seconds as a float."""

import math
from typing import Final

from bridges.rmf.definitions import Duration, Time
from bridges.rmf.transport import TransportError

ENDS: Final = 2**31
"""RMF's Time counts seconds with 32 bits: its last is on 2038-01-19."""


class ClockError(TransportError):
    """The wall clock says a time that no stamp can hold."""


def stamp(wall: float) -> Time:
    """Seconds since the epoch as RMF's Time; never negative, as 0.0 means never. Raises ClockError."""
    if not wall < ENDS:
        raise ClockError("the clock is past 2038-01-19, where RMF's stamps end: set the clock")
    fraction, seconds = math.modf(max(0.0, wall))
    return Time(sec=int(seconds), nanosec=int(fraction * 1e9))


def duration(seconds: float) -> Duration:
    """Seconds as RMF's Duration."""
    whole = math.floor(seconds)
    return Duration(sec=whole, nanosec=int((seconds - whole) * 1e9))


def in_seconds(value: Time | Duration) -> float:
    """Seconds (since the epoch, for a Time)."""
    return value.sec + value.nanosec * 1e-9
