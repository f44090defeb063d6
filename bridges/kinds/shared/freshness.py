"""Decides whether an adapter's request counts (is obeyed), or is a replay of an old request.

A stamp comes from the requester's clock, which may disagree with our clock. Therefore a stamp is first
compared with the earlier stamps of the same requester.

Rules:
FRESHNESS-1. A request counts if its stamp is newer than the stamps of all requests of the same
   requester that counted before. An END is compared only with earlier ENDs. The reason is that an
   operator may end a robot's session, and the operator's clock may differ.
FRESHNESS-2. A retained topic (`adapter_lift_requests`) replays up to 100 old requests of every
   adapter to each new subscriber. The replay comes again when an adapter's network comes back. On
   such a topic an equal stamp is a replay. A requester's first request counts only if it was sent
   after our own start, and after we last forgot a lift with its requesters. Later requests are
   compared only with the requester's own stamps. If the YAML sets `clock_synchronised`, the age of
   every request is judged too.
FRESHNESS-3. On a topic that is not retained (`adapter_door_requests`) an old request was delayed or
   arrived twice. On such a topic an equal stamp counts, because a requester without a clock always
   sends 0. A requester's first request counts. A requester that holds no door is forgotten after a
   silence of FORGOTTEN_S. Its next request then counts as its first.
FRESHNESS-4. During the quiet start (the first seconds, in which the node only listens) a stamp from the
   future does not count on a retained topic. The reason is that every replayed request looks new if our
   clock is not set yet.
FRESHNESS-5. A rejected request may come from a live requester whose clock is wrong or was set back.
   Such a request counts when the requester has repeated it for long enough. On retained topics that
   time is REPLAY_S, because a replay is shorter. On other topics it is LATE_S, because no message is
   later. The stamps of the repeats must rise, or all be 0. A pause of BROKEN_OFF_S, or a stamp that
   does not rise, restarts that time.
"""

from collections.abc import Collection, Mapping
from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.durations import AGES_AGO, FORGOTTEN_S, NEVER
from bridges.messages.definitions import Time

REPLAY_S: Final = 1.0
"""The longest duration of a replay (s). A replay comes in a burst, while a live requester repeats its
request at 1 Hz."""
LATE_S: Final = 10.0
"""The greatest delay (s) of a message on a topic that is not retained."""
BROKEN_OFF_S: Final = 3.0
FUTURE_S: Final = 2.0
MAX_REQUESTERS: Final = 200
SECOND_NS: Final = 10**9


class Rules(msgspec.Struct, frozen=True):
    """The rules for judging a topic's requests.

    `most_s`: the greatest age (s) of a request, by its stamp. `known_clocks`: after the first request
    that counted, a requester is judged only by its own stamps. `future_s`: the greatest time (s) by
    which a stamp may be ahead of our clock. `retained`: the topic replays old requests.
    """

    most_s: float = NEVER
    known_clocks: bool = True
    future_s: float = NEVER
    retained: bool = True

    @property
    def doubt_s(self) -> float:
        """The time (s) for which a requester must repeat a rejected request until the request
        counts."""
        return REPLAY_S if self.retained else LATE_S


class Requester(msgspec.Struct, frozen=True):
    """The record of one requester's stamps. All stamps have the same unit, and come from the
    requester's own clock.

    `newest`: the newest stamp that counted. `newest_end`: the newest stamp of an END that counted.
    `heard_at`: the time when a request last counted. `doubted`: the stamp of the last request that did
    not count. `doubted_since`, `doubted_at`: if the latest requests in a row did not count, the times
    of the first and the last of them. Names in `_at` or `_since` are times (s) by our clock.
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
        """Note one request, `age_s` old by our clock. Return the new record, and whether the request
        counts."""
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
"""The record of each requester, by its name. The requester that has been silent for the longest time
comes first."""


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
    """Note one request in the table. Return the new table, and the reason why the request does not
    count ("" if it counts).

    Anybody can invent names, so the table has a bound. A full table drops the requester that has been
    silent for the longest time, but never one of the `holders`.
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
    """Return a request_time in ns. Raises RequestRefused for an impossible time."""
    if stamp.sec < 0 or stamp.nanosec >= SECOND_NS:
        raise RequestRefused("impossible request_time", f"{stamp.sec} s {stamp.nanosec} ns")
    return stamp.sec * SECOND_NS + stamp.nanosec
