"""Replayed requests: RMF repeats a request of an earlier ride while a robot may be on the threshold.

A fleet adapter retains its last 100 requests. When RMF's supervisor restarts, or reaches a cut-off
adapter again, the supervisor hears all these requests once more. The supervisor passes each request on
with a new stamp (rmf_ros2, lift_supervisor/Node.cpp). Requests of earlier rides would release the door
before the supervisor passes on the request of the present ride. On `adapter_lift_requests` this node
hears no replays, but only the requests that each robot sends now.

Rules:
LIFT-REPLAYED-1. While the door is held, a request for another destination is in doubt (it does not
   count yet) if the robot's own last request was for the present destination. That own request may be
   older than the session, because the robot may have lost its connection after that request.
LIFT-REPLAYED-2. The request in doubt counts when the robot itself asks for that destination too. It
   also counts when LASTS_S have passed and no other destination was requested in that time.
LIFT-REPLAYED-3. An END is never in doubt. A request within the grace (the time after END) first
   restores the session as it was. After that LIFT-REPLAYED-1 judges the request.
"""

from collections.abc import Mapping
from typing import Final

from bridges.kinds.lift.memory import Doubted, LiftSession
from bridges.kinds.lift.signals import EndRequested, LiftRequested

LASTS_S: Final = 3.0
"""The time (s) for which a request must be repeated. After this time it cannot be a replay, because a
replay is over within a second, and the robot repeats its own request at 1 Hz."""
MOST: Final = 100
"""The greatest number of robots in the table. It is more than the robots of any site. If a further
robot comes, the robot that was silent for longest is dropped."""


def noted(own: Mapping[str, str], asked: LiftRequested | EndRequested) -> Mapping[str, str]:
    """Note a robot's own request in the table, which maps a session to its destination. An END removes
    the session."""
    others = {session: floor for session, floor in own.items() if session != asked.session_id}
    if isinstance(asked, EndRequested):
        return others
    if len(others) == MOST:
        del others[next(iter(others))]
    return {**others, asked.session_id: asked.destination}


def doubt(
    session: LiftSession, request: LiftRequested, own: str, held_open: bool, now: float
) -> Doubted | None:
    """Return a mark if this session's request does not count yet. Return None if the request counts.

    `own`: the destination that the robot itself last requested.
    """
    other = request.destination != session.destination
    if not (held_open and other and request.agv and own == session.destination):
        return None
    before = session.doubted
    if before is None or before.destination != request.destination:
        return Doubted(request.destination, now)
    return before if now < before.since + LASTS_S else None


def confirmed(session: LiftSession, asked: LiftRequested | EndRequested) -> bool:
    """Return whether the robot itself asks for the doubted destination."""
    if session.doubted is None or isinstance(asked, EndRequested):
        return False
    return asked.destination == session.doubted.destination
