"""Between RMF's Time and Duration and seconds as a float."""

import math

from bridges.rmf.definitions import Duration, Time


def stamp(wall: float) -> Time:
    """Seconds since the epoch as RMF's Time; never negative, as 0.0 means never."""
    fraction, seconds = math.modf(max(0.0, wall))
    return Time(sec=int(seconds), nanosec=int(fraction * 1e9))


def duration(seconds: float) -> Duration:
    """Seconds as RMF's Duration."""
    whole = math.floor(seconds)
    return Duration(sec=whole, nanosec=int((seconds - whole) * 1e9))


def in_seconds(value: Time | Duration) -> float:
    """Seconds (since the epoch, for a Time)."""
    return value.sec + value.nanosec * 1e-9
