"""Does a request of an adapter count, or is it an echo from the past?

A request's stamp is by its requester's clock, which need not agree with ours. So stamps of one
requester are compared with each other first. Rules:
1. A request counts if it is newer than all that has counted of its requester. An END is compared
   with earlier ENDs only: an operator ends a robot's session by another clock than the robot's.
2. On a retained topic (`adapter_lift_requests`) whoever subscribes gets up to 100 old requests of
   every adapter at once, and again when an adapter's network comes back. There an equal stamp is a
   replay, and the first request of a requester must have been sent after our own start. One that has
   counted has a clock that we know. With `clock_synchronised` every request is judged by its age.
3. On a topic that is not retained (`adapter_door_requests`) an old request was late or came twice.
   There an equal stamp counts (who has no clock always sends 0), and so does a requester's first
   request. A requester that has been silent for FORGOTTEN_S and holds nothing is new again.
4. During the quiet start of a retained topic a stamp from the future does not count: our clock has
   not been set yet, and everything replayed looks new.
5. A request that does not count may come from a live requester whose clock is wrong or was set back.
   It counts once it is repeated, with stamps that rise or are all 0, for longer than a replay takes
   (retained: REPLAY_S) or a message can be late (LATE_S). After a break of BROKEN_OFF_S, or when a
   stamp does not rise, that time starts again.
"""

from collections.abc import Collection, Mapping
from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.core.decision import RequestRefused
from bridges.core.durations import AGES_AGO, FORGOTTEN_S, NEVER
from bridges.rmf.definitions import Time

REPLAY_S: Final = 1.0
"""A replay comes in a burst; a live requester repeats itself at 1 Hz."""
LATE_S: Final = 10.0
"""No message is late for so long."""
BROKEN_OFF_S: Final = 3.0
FUTURE_S: Final = 2.0
MAX_REQUESTERS: Final = 200
SECOND_NS: Final = 10**9


class Rules(msgspec.Struct, frozen=True):
    """How a topic's requests are judged.

    `most_s`: how old a request may be by its stamp. `known_clocks`: a requester that has counted
    before is judged by its own clock only. `future_s`: how far ahead of us a stamp may be.
    `retained`: old requests are replayed on this topic.
    """

    most_s: float = NEVER
    known_clocks: bool = True
    future_s: float = NEVER
    retained: bool = True

    @property
    def doubt_s(self) -> float:
        """How long a requester must repeat itself before it is believed."""
        return REPLAY_S if self.retained else LATE_S


class Requester(msgspec.Struct, frozen=True):
    """What has been heard of one requester. Stamps are in one unit, by its clock.

    `newest`, `newest_end`: of what counted. `heard_at`: when that came (s, ours). `doubted`: of what
    has not counted since `doubted_since`, without a break until `doubted_at` (s, ours).
    """

    newest: float = AGES_AGO
    newest_end: float = AGES_AGO
    doubted: float = AGES_AGO
    doubted_since: float = AGES_AGO
    doubted_at: float = AGES_AGO
    heard_at: float = AGES_AGO

    def hears(
        self, stamp: float, age_s: float, now: float, rules: Rules, *, ends: bool = False
    ) -> tuple["Requester", bool]:
        """Take one request, `age_s` old by our clock. True if it counts."""
        if self._is_live(stamp, age_s, rules, ends=ends):
            newest = max(self.newest, stamp)
            newest_end = max(self.newest_end, stamp) if ends else self.newest_end
            return Requester(newest, newest_end, heard_at=now), True
        doubted = self._doubt(stamp, now)
        if now < doubted.doubted_since + rules.doubt_s:
            return doubted, False
        newest_end = stamp if ends else min(self.newest_end, stamp)
        return replace(doubted, newest=stamp, newest_end=newest_end, heard_at=now), True

    def _is_live(self, stamp: float, age_s: float, rules: Rules, *, ends: bool) -> bool:
        newest = self.newest_end if ends else self.newest
        if stamp < newest or (stamp == newest and rules.retained):
            return False
        known = rules.known_clocks and self.newest > AGES_AGO
        return known or -rules.future_s <= age_s <= rules.most_s

    def _doubt(self, stamp: float, now: float) -> "Requester":
        goes_on = now <= self.doubted_at + BROKEN_OFF_S and (stamp > self.doubted or stamp == 0)
        since = self.doubted_since if goes_on else now
        return replace(self, doubted=stamp, doubted_since=since, doubted_at=now)


Requesters = Mapping[str, Requester]
"""By name, in the order in which they were last heard."""


def hear(
    requesters: Requesters,
    who: str,
    stamp: float,
    now: float,
    rules: Rules,
    *,
    age_s: float = 0.0,
    ends: bool = False,
    holders: Collection[str] = (),
) -> tuple[Requesters, str]:
    """Take one request into the table. Returns it, and why the request does not count ("": it does).

    The table has a bound, as anybody can make names up: who was heard least lately makes room, but a
    holder never does.
    """
    known = {
        name: requester
        for name, requester in requesters.items()
        if rules.retained or name in holders or now < requester.heard_at + FORGOTTEN_S
    }
    if who not in known and len(known) >= MAX_REQUESTERS:
        oldest = next((name for name in known if name not in holders), None)
        if oldest is None:
            return known, "too many requesters"
        del known[oldest]
    requester, counts = known.pop(who, Requester()).hears(stamp, age_s, now, rules, ends=ends)
    known[who] = requester
    return known, "" if counts else "stale request"


def in_ns(stamp: Time) -> int:
    """A request_time in ns. Raises RequestRefused for one that no clock shows."""
    if stamp.sec < 0 or stamp.nanosec >= SECOND_NS:
        raise RequestRefused("impossible request_time", f"{stamp.sec} s {stamp.nanosec} ns")
    return stamp.sec * SECOND_NS + stamp.nanosec
