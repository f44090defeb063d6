"""Notices that the wall clock was set back, because Cyclone DDS waits by it.

0.10.5 (ROS 2 Jazzy) always does (github.com/eclipse-cyclonedds/cyclonedds, issue 1995); 11.0.1 does in
the wheel on PyPI, which is built without pthread_condattr_setclock. When the clock is set back,
Cyclone's threads sleep longer by the size of the step. Meanwhile a node renews no lease, so that others
forget it after 10 s; it answers no new node, and asks for nothing that was lost. A node that has joined
since waits by the new time. A step forward wakes the threads early, which does no harm.
"""

import time
from typing import Final

SET_BACK_S: Final = 1.0
"""A smaller step back is slept through: Cyclone renews a lease of 10 s every 8 s."""


class WallClock:
    """`ahead_s`, here and below: how far the wall clock is ahead of one that never steps (s)."""

    def __init__(self, ahead_s: float) -> None:
        self._most_s = ahead_s

    def set_back_s(self, ahead_s: float) -> float:
        """How far it was set back since a step was last found; 0 for SET_BACK_S or less.

        Small steps add up, because a thread may sleep through all of them.
        """
        self._most_s = max(self._most_s, ahead_s)
        back_s = self._most_s - ahead_s
        if back_s <= SET_BACK_S:
            return 0.0
        self._most_s = ahead_s
        return back_s


def ahead_s() -> float:
    """How far the wall clock is ahead of the time since the machine's start, its sleep included (s)."""
    return time.time() - time.clock_gettime(time.CLOCK_BOOTTIME)
