"""The values that the lift supervisor keeps for one lift, and the settings that it needs (its
limits)."""

from typing import Final

import msgspec

from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.kinds.lift_supervisor.signals import LiftStateHeard, Target
from bridges.kinds.shared.durations import AGES_AGO, NEVER, SILENT_S
from bridges.kinds.shared.freshness import FUTURE_S, Requesters, Rules
from bridges.kinds.shared.graph_kind import LISTENS
from bridges.messages.definitions import LiftMode, LiftRequest

NOBODY_IS_SENT: Final = (LiftMode.MODE_FIRE, LiftMode.MODE_EMERGENCY, LiftMode.MODE_OFFLINE)
"""The lift modes in which no robot is sent to the lift."""


class LiftSupervisorLimits(msgspec.Struct, frozen=True):
    """The durations (s) that the site has set. `clock_synchronised`: all clocks of the site agree."""

    silent_after_s: float = 10.0
    orphan_after_s: float = 3.0
    holder_alarm_s: float = 60.0
    holder_ttl_s: float = NEVER
    clock_synchronised: bool = False
    max_request_age_s: float = 10.0

    @classmethod
    def of(cls, settings: LiftSupervisorSettings) -> "LiftSupervisorLimits":
        """Make the limits from the YAML."""
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
    """A session that wants the lift: its last request, and the times of its first and last request."""

    session: str
    target: Target
    since: float
    heard_at: float


class Turn(msgspec.Struct, frozen=True):
    """The session whose requests we pass on.

    `since`: the start of the turn. `ends`: we now send the session's END. `by_person`: a person sent
    this END. `seen`: the lift's states have shown this session.
    """

    session: str
    since: float
    ends: bool = False
    seen: bool = False
    by_person: bool = False


class SupervisedLift(msgspec.Struct, frozen=True):
    """The memory of one lift from event to event.

    `passive`: if we may not publish, the reason why requesters must wait. `claims`: the sessions that
    wait for the lift and the session that has its turn (the holder), in the order of their first
    requests. `heard_at`: the time of the last adapter request. `requesters`: the record of each
    session's stamps. `shown`: the latest state. `shown_at`: the time of the latest state.
    `session_since`: the states have shown the present session since this time. `flowing_since`: states
    have come without a gap since this time. `sent`: the last request of this turn. `last_sent`: the
    last request of any turn, sent at `sent_at`. `prompted`: the request must be repeated.
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
        """Find the claim of this session; None if the session has no claim."""
        return next((claim for claim in self.claims if claim.session == session), None)

    @property
    def session_shown(self) -> str:
        """The session in the lift's latest state; "" for none."""
        return self.shown.session if self.shown else ""

    @property
    def nobody_is_sent(self) -> bool:
        """Return whether the lift's mode forbids sending a robot to the lift."""
        return self.shown is not None and self.shown.mode in NOBODY_IS_SENT

    def flows(self, now: float) -> bool:
        """Return whether the lift's states keep arriving. Before the first state the answer is True."""
        return self.shown is None or now <= self.shown_at + SILENT_S

    def gone_at(self, claim: SessionClaim, now: float, after_s: float) -> float:
        """Return the time when this requester will have been silent for `after_s`; NEVER if the lift
        itself is silent."""
        if not self.flows(now):
            return NEVER
        return max(claim.heard_at, self.flowing_since) + after_s

    def rules(self, now: float, limits: LiftSupervisorLimits) -> Rules:
        """Return the rules that now apply to the stamps of adapters' requests."""
        if limits.clock_synchronised:
            return Rules(limits.max_request_age_s, known_clocks=False)
        return Rules(now - self.started_at, future_s=NEVER if self.may_speak else FUTURE_S)
