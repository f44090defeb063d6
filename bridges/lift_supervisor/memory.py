"""What the lift supervisor's core remembers of one lift, and the events that it takes in."""

import math
from collections.abc import Mapping
from typing import Final

import msgspec

from bridges.core.decision import OperatorReset
from bridges.core.graph_kind import MaySpeak, Woken
from bridges.lift_supervisor.freshness import Voice
from bridges.rmf.definitions import LiftMode, LiftRequest

FLOWING_S: Final = 3.0
"""States come at 1 Hz; after a gap as long as this the lift was silent."""
NEVER: Final = math.inf

NOBODY_IS_SENT: Final = (LiftMode.MODE_FIRE, LiftMode.MODE_EMERGENCY, LiftMode.MODE_OFFLINE)
"""Modes in which a lift is not RMF's to send robots to."""


class Limits(msgspec.Struct, frozen=True):
    """The durations (s) that the site has set, and whether its clocks agree."""

    silent_after_s: float = 10.0
    orphan_after_s: float = 3.0
    holder_alarm_s: float = 60.0
    holder_ttl_s: float = NEVER
    clock_synchronised: bool = False
    max_request_age_s: float = 10.0


class Wish(msgspec.Struct, frozen=True):
    """What a session asks of the lift, as LiftRequest has it."""

    request_type: int
    floor: str
    door: int


class Asked(msgspec.Struct, frozen=True):
    """An adapter's request for AGV or HUMAN mode; `stamp` is its own (s), `age_s` by our clock."""

    session: str
    wish: Wish
    stamp: float
    age_s: float


class Ended(msgspec.Struct, frozen=True):
    """An adapter's, or an operator's, END_SESSION, whatever its other fields say."""

    session: str
    stamp: float
    age_s: float


class Shown(msgspec.Struct, frozen=True):
    """A LiftState."""

    session: str
    floor: str
    destination: str
    door: int
    mode: int
    floors: tuple[str, ...] = ()

    def satisfies(self, session: str, wish: Wish) -> bool:
        """Does it show what was asked? As rmf_lift_supervisor judges it."""
        there = wish.floor == self.floor and not self.destination
        return (
            (wish.floor == self.destination or there)
            and wish.door == self.door
            and session == self.session
        )


Event = Asked | Ended | Shown | MaySpeak | Woken | OperatorReset


class Claim(msgspec.Struct, frozen=True):
    """A session that wants the lift: what it last asked, since when it asks, and when it last did."""

    session: str
    wish: Wish
    since: float
    heard_at: float


class Turn(msgspec.Struct, frozen=True):
    """Whom we speak for. `ends`: its END is what we send. `seen`: the lift has shown the session."""

    session: str
    since: float
    ends: bool = False
    seen: bool = False


class Memory(msgspec.Struct, frozen=True):
    """Everything that outlives an event.

    `claims`: in the order of first requests, the holder's among them. `heard_at`: when an adapter was
    last heard, `voices`: what of each. `shown_at`: when the latest state came; `session_since`: since
    when its session is shown; `flowing_since`: since when states come without a gap. `sent`: the last
    request of this turn; `prompted`: it is worth repeating.
    """

    lift: str
    started_at: float
    may_speak: bool = False
    claims: tuple[Claim, ...] = ()
    turn: Turn | None = None
    shown: Shown | None = None
    shown_at: float = -NEVER
    session_since: float = -NEVER
    flowing_since: float = -NEVER
    heard_at: float = -NEVER
    voices: Mapping[str, Voice] = {}
    sent: LiftRequest | None = None
    sent_at: float = -NEVER
    prompted: bool = False

    def claim(self, session: str) -> Claim | None:
        """This session's."""
        for claim in self.claims:
            if claim.session == session:
                return claim
        return None

    @property
    def session_shown(self) -> str:
        """Who has the lift by its own word; "" for nobody."""
        return self.shown.session if self.shown else ""

    def flows(self, now: float) -> bool:
        """Do the lift's states come? Before the first one, nothing is waited for."""
        return self.shown is None or now <= self.shown_at + FLOWING_S

    def gone_at(self, claim: Claim, now: float, after_s: float) -> float:
        """When a requester will have been silent for so long; never while the lift is silent."""
        if not self.flows(now):
            return NEVER
        return max(claim.heard_at, self.flowing_since) + after_s

    @property
    def nobody_is_sent(self) -> bool:
        """Is the lift in a mode in which no robot is sent to it?"""
        return self.shown is not None and self.shown.mode in NOBODY_IS_SENT
