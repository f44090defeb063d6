"""Does a request of an adapter count, or is it older than what it has said already?

By the requester's own stamps, which need not be by our clock. `adapter_door_requests` is not
retained: an old request is one that was late, or came twice. Rules, for one requester at one door:
1. A request counts if it is no older than the newest that has counted. Of two with the same stamp
   the later to arrive is believed: who sends no stamp sends 0 each time.
2. Who is only heard with older ones, that keep up with the time, for BACK_S, has had its clock set
   back: it counts again. No message is late for so long.
"""

import math

import msgspec
from msgspec.structs import replace

BACK_S = 10.0
BROKEN_OFF_S = 3.0
"""A requester that wants something repeats itself at 1 Hz."""
AGES_AGO = -math.inf


class Voice(msgspec.Struct, frozen=True):
    """What has been heard of one requester; stamps in ns by its clock, times in s by ours.

    `newest`: of what counted, last at `heard_at`. `doubted`: the newest of what did not, of late,
    without a break since `doubted_since` until `doubted_at`.
    """

    newest: int
    heard_at: float
    doubted: int = -1
    doubted_since: float = AGES_AGO
    doubted_at: float = AGES_AGO

    def hears(self, stamp: int, now: float) -> tuple["Voice", bool]:
        """Take one more message. True if it counts."""
        if stamp >= self.newest:
            return Voice(stamp, now), True
        voice = self._doubt(stamp, now)
        if now < voice.doubted_since + BACK_S:
            return voice, False
        return Voice(stamp, now), True

    def _doubt(self, stamp: int, now: float) -> "Voice":
        """The doubts go on, or begin anew."""
        if now > self.doubted_at + BROKEN_OFF_S:
            return replace(self, doubted=stamp, doubted_since=now, doubted_at=now)
        if stamp <= self.doubted:
            return self
        return replace(self, doubted=stamp, doubted_at=now)
