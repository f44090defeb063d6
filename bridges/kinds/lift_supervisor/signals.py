"""Events of the lift supervisor's core: adapters' requests and lifts' states."""

import msgspec

from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken


class Target(msgspec.Struct, frozen=True):
    """A session's destination, in the fields and values of LiftRequest."""

    request_type: int
    floor: str
    door: int


class RideRequested(msgspec.Struct, frozen=True):
    """An adapter's request for AGV or HUMAN mode.

    `stamp`: the request's time (s) by the adapter's clock. `age_s`: the request's age (s) by our clock.
    """

    session: str
    target: Target
    stamp: float
    age_s: float


class RideEnded(msgspec.Struct, frozen=True):
    """An END_SESSION of an adapter or an operator, with any floor. `by_person`: the message has
    DOOR_OPEN, by which the lift's node recognises a person's END."""

    session: str
    stamp: float
    age_s: float
    by_person: bool = False


class LiftStateHeard(msgspec.Struct, frozen=True):
    """A LiftState."""

    session: str
    floor: str
    destination: str
    door: int
    mode: int
    floors: tuple[str, ...] = ()

    def satisfies(self, session: str, target: Target) -> bool:
        """Return whether the state fulfils the request. RMF's rmf_lift_supervisor uses the same
        rule."""
        there = target.floor == self.floor and not self.destination
        return (
            (target.floor == self.destination or there)
            and target.door == self.door
            and session == self.session
        )


Event = RideRequested | RideEnded | LiftStateHeard | MaySpeak | Woken | OperatorReset
