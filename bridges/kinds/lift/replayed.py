"""A floor of an earlier ride, asked for again while a robot may be on the threshold.

A fleet adapter retains its last 100 requests. When RMF's supervisor restarts, or finds an adapter again
that was cut off, it hears them all once more and passes each on with a new stamp (rmf_ros2,
lift_supervisor/Node.cpp). Some are of earlier rides: the door would be let go before the last one is
heard. The robot's own requests on `adapter_lift_requests` are heard here once, when they are sent.
Rules:
LIFT-REPLAYED-1. While the door is held, a request for another destination is doubted if the robot's own
   last request was for the present one. It does not matter if that request came before the robot got
   the lift: the robot may have been cut off since.
LIFT-REPLAYED-2. It counts when the robot itself asks for that destination too, or when nothing else has
   been asked for during LASTS_S.
LIFT-REPLAYED-3. An END counts as always. A request within the grace resumes the session as it was; then
   LIFT-REPLAYED-1 decides.
"""

from collections.abc import Mapping
from typing import Final

from bridges.kinds.lift.memory import Doubted, LiftSession
from bridges.kinds.lift.signals import EndRequested, LiftRequested

LASTS_S: Final = 3.0
"""A replay is over within a second, and the robot's own repeats come at 1 Hz."""
MOST: Final = 100
"""More robots than any site has. Beyond this number the one that was heard first is forgotten."""


def noted(own: Mapping[str, str], asked: LiftRequested | EndRequested) -> Mapping[str, str]:
    """Session -> destination, once a robot itself has asked for this."""
    others = {session: floor for session, floor in own.items() if session != asked.session_id}
    if isinstance(asked, EndRequested):
        return others
    if len(others) == MOST:
        del others[next(iter(others))]
    return {**others, asked.session_id: asked.destination}


def doubt(
    session: LiftSession, request: LiftRequested, own: str, held_open: bool, now: float
) -> Doubted | None:
    """The doubt about a request of this session; None if it counts. `own`: where its robot would go."""
    other = request.destination != session.destination
    if not (held_open and other and request.agv and own == session.destination):
        return None
    before = session.doubted
    if before is None or before.destination != request.destination:
        return Doubted(request.destination, now)
    return before if now < before.since + LASTS_S else None


def confirmed(session: LiftSession, asked: LiftRequested | EndRequested) -> bool:
    """Does the robot itself ask for the destination that was doubted?"""
    if session.doubted is None or isinstance(asked, EndRequested):
        return False
    return asked.destination == session.doubted.destination
