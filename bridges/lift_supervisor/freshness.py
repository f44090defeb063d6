"""Does a request of an adapter count, or is it an echo from the past?

`adapter_lift_requests` is retained: whoever subscribes gets up to 100 old requests of every adapter
at once, and again when an adapter's network comes back. A request's own stamp tells, by the
requester's clock, which need not be ours:
1. A request counts if it is newer than all that has counted of its requester, and sent after our own
   start (or by a requester whose clock we know already from one that counted). With
   `clock_synchronised`, it must instead be no older than `max_request_age_s`.
2. During the quiet start one from the future does not count: it is our clock that has not been set
   yet, and everything replayed looks new.
3. END is held only against earlier ENDs: an operator ends a robot's session by another clock.
4. What does not count is no live request, or its requester's clock is wrong, or was set back. It
   counts once it is repeated, with stamps that rise, for longer than a replay takes.
"""

import math

import msgspec
from msgspec.structs import replace

REPLAY_S = 1.0
"""A replay comes in a burst; a live requester repeats itself at 1 Hz."""
BROKEN_OFF_S = 3.0
FUTURE_S = 2.0
AGES_AGO = -math.inf


class Rules(msgspec.Struct, frozen=True):
    """`most_s`: how old a request may be by its stamp. `known_clocks`: a requester heard before may
    be by its own clock. `future_s`: how far ahead of us a stamp may be."""

    most_s: float
    known_clocks: bool = True
    future_s: float = math.inf


class Voice(msgspec.Struct, frozen=True):
    """What has been heard of one requester; stamps in seconds by its clock.

    `newest`, `newest_end`: of what counted. `doubted`: of what did not, of late, without a break since
    `doubted_since` until `doubted_at` (s, ours).
    """

    newest: float = AGES_AGO
    newest_end: float = AGES_AGO
    doubted: float = AGES_AGO
    doubted_since: float = AGES_AGO
    doubted_at: float = AGES_AGO

    def heard(
        self, stamp: float, age_s: float, now: float, rules: Rules, *, ends: bool
    ) -> tuple["Voice", bool]:
        """Take one message, `age_s` old by our clock. True if it counts."""
        if self._is_live(stamp, age_s, rules, ends=ends):
            newest = max(self.newest, stamp)
            newest_end = max(self.newest_end, stamp) if ends else self.newest_end
            return Voice(newest, newest_end), True
        voice = self._doubt(stamp, now)
        if now < voice.doubted_since + REPLAY_S:
            return voice, False
        newest_end = stamp if ends else min(self.newest_end, stamp)
        return replace(voice, newest=stamp, newest_end=newest_end), True

    def _is_live(self, stamp: float, age_s: float, rules: Rules, *, ends: bool) -> bool:
        if stamp <= (self.newest_end if ends else self.newest):
            return False
        known = rules.known_clocks and self.newest > AGES_AGO
        return known or -rules.future_s <= age_s <= rules.most_s

    def _doubt(self, stamp: float, now: float) -> "Voice":
        """The doubts go on, or begin anew. Who sends no stamp (0) just repeats it."""
        goes_on = now <= self.doubted_at + BROKEN_OFF_S and (stamp > self.doubted or stamp == 0.0)
        since = self.doubted_since if goes_on else now
        return replace(self, doubted=stamp, doubted_since=since, doubted_at=now)
