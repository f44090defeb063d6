"""The clock that measures the age of a reading or a message."""

import time


def machine_s() -> float:
    """Return the time (s) since the machine's start, including the time in which the machine was
    suspended."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)
