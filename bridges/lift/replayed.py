"""A floor of an earlier ride, asked for again while a robot may be on the threshold.

A fleet adapter retains its last 100 requests. When RMF's supervisor restarts, or finds an adapter again
that was cut off, it hears them all once more and passes each on with a new stamp (rmf_ros2,
lift_supervisor/Node.cpp). Some are of earlier rides: the door would be let go before the last one is
heard. What the robot itself asks on `adapter_lift_requests` is heard here as it is said, and never
again. Rules:
1. While the door is held, a request for another destination is doubted if the robot's own last request
   was for the present one.
2. It counts when the robot itself asks for that destination too, or when nothing else has been asked
   for during LASTS_S.
3. An END counts as always. A request within the grace resumes the session as it was; then rule 1
   decides.
"""

from typing import Final

from bridges.lift.memory import Doubted, Session
from bridges.lift.signals import Requested

LASTS_S: Final = 3.0
"""What is heard again comes within a second, and the robot's own repeats come at 1 Hz."""


def doubt(session: Session, request: Requested, held_open: bool, now: float) -> Doubted | None:
    """The doubt about a request of this session; None if it counts."""
    other = request.destination != session.destination
    if not (held_open and other and request.agv and session.own == session.destination):
        return None
    before = session.doubted
    if before is None or before.destination != request.destination:
        return Doubted(request.destination, now)
    return before if now < before.since + LASTS_S else None


def confirmed(session: Session) -> bool:
    """Does the robot itself ask for the destination that was doubted?"""
    return session.doubted is not None and session.own == session.doubted.destination
