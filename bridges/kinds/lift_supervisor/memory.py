"""What the lift supervisor's core remembers of one lift, and the limits that it is given."""

from typing import Final

import msgspec

from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.kinds.lift_supervisor.signals import LiftStateHeard, Target
from bridges.kinds.shared.durations import AGES_AGO, NEVER, SILENT_S
from bridges.kinds.shared.freshness import FUTURE_S, Requesters, Rules
from bridges.kinds.shared.graph_kind import LISTENS
from bridges.messages.definitions import LiftMode, LiftRequest

NOBODY_IS_SENT: Final = (LiftMode.MODE_FIRE, LiftMode.MODE_EMERGENCY, LiftMode.MODE_OFFLINE)
"""The modes in which no robot is sent to a lift."""


class LiftSupervisorLimits(msgspec.Struct, frozen=True):
    """The durations (s) that the site has set, and whether its clocks agree."""

    silent_after_s: float = 10.0
    orphan_after_s: float = 3.0
    holder_alarm_s: float = 60.0
    holder_ttl_s: float = NEVER
    clock_synchronised: bool = False
    max_request_age_s: float = 10.0

    @classmethod
    def of(cls, settings: LiftSupervisorSettings) -> "LiftSupervisorLimits":
        """From the YAML."""
        ttl_s = settings.holder_ttl_s
        return cls(
            silent_after_s=settings.silent_after_s,
            orphan_after_s=settings.quiet_start_s,
            holder_alarm_s=settings.holder_alarm_s,
            holder_ttl_s=NEVER if ttl_s is None else ttl_s,
            clock_synchronised=settings.clock_synchronised,
            max_request_age_s=settings.max_request_age_s,
        )


class SessionClaim(msgspec.Struct, frozen=True):
    """A session that wants the lift: its last request, and when its first and last requests came."""

    session: str
    target: Target
    since: float
    heard_at: float


class Turn(msgspec.Struct, frozen=True):
    """The session whose request we pass on. `ends`: we send its END, which a person has asked for
    if `by_person`. `seen`: the lift has shown it."""

    session: str
    since: float
    ends: bool = False
    seen: bool = False
    by_person: bool = False


class SupervisedLift(msgspec.Struct, frozen=True):
    """Everything that outlives an event.

    `passive`: what those wait for that wait for us, while we may not publish.
    `claims`: in the order of first requests, with the holder's. `heard_at`: when an adapter was last
    heard. `requesters`: what was heard of each. `shown`: the latest state, which came at `shown_at`;
    `session_since`: since when it shows this session. `flowing_since`: since when states come without
    a gap. `sent`: the last request of this turn; `last_sent`: of any turn, at `sent_at`. `prompted`:
    something calls for a repeat.
    """

    lift: str
    started_at: float
    may_speak: bool = False
    passive: str = LISTENS
    claims: tuple[SessionClaim, ...] = ()
    turn: Turn | None = None
    shown: LiftStateHeard | None = None
    shown_at: float = AGES_AGO
    session_since: float = AGES_AGO
    flowing_since: float = AGES_AGO
    heard_at: float = AGES_AGO
    requesters: Requesters = {}
    sent: LiftRequest | None = None
    last_sent: LiftRequest | None = None
    sent_at: float = AGES_AGO
    prompted: bool = False

    def claim(self, session: str) -> SessionClaim | None:
        """The claim of this session; None where it has none."""
        return next((claim for claim in self.claims if claim.session == session), None)

    @property
    def session_shown(self) -> str:
        """The session that the lift shows; "" for none."""
        return self.shown.session if self.shown else ""

    @property
    def nobody_is_sent(self) -> bool:
        """Is the lift in a mode in which no robot is sent to it?"""
        return self.shown is not None and self.shown.mode in NOBODY_IS_SENT

    def flows(self, now: float) -> bool:
        """Do the lift's states come? True before the first one."""
        return self.shown is None or now <= self.shown_at + SILENT_S

    def gone_at(self, claim: SessionClaim, now: float, after_s: float) -> float:
        """When this requester will have been silent for `after_s`; NEVER while the lift is silent."""
        if not self.flows(now):
            return NEVER
        return max(claim.heard_at, self.flowing_since) + after_s

    def rules(self, now: float, limits: LiftSupervisorLimits) -> Rules:
        """How the stamps of adapters' requests are judged now."""
        if limits.clock_synchronised:
            return Rules(limits.max_request_age_s, known_clocks=False)
        return Rules(now - self.started_at, future_s=NEVER if self.may_speak else FUTURE_S)
