"""Replayed requests: a floor of an earlier ride is requested while a robot may be on the threshold.

A fleet adapter retains its last 100 requests. When RMF's supervisor restarts, or reaches a cut-off
adapter again, it hears all these requests once more and passes each on with a new stamp (rmf_ros2,
lift_supervisor/Node.cpp). Requests of earlier rides would release the door before the present request
is heard. On `adapter_lift_requests` our node hears no replays, but only the requests that each robot
sends now.
Rules:
LIFT-REPLAYED-1. If the door is held, a request for another destination is doubted if the robot's own
   last request was for the present destination. That own request counts even if the robot sent it
   before it got the lift, because the robot may have been cut off since.
LIFT-REPLAYED-2. The doubted request counts when the robot itself asks for that destination too, or
   when LASTS_S have passed without a request for another destination.
LIFT-REPLAYED-3. An END is never doubted. A request within the grace resumes the session as it was; then
   LIFT-REPLAYED-1 decides.
"""

from collections.abc import Mapping
from typing import Final

from bridges.kinds.lift.memory import Doubted, LiftSession
from bridges.kinds.lift.signals import EndRequested, LiftRequested

LASTS_S: Final = 3.0
"""The time (s) after which a request is no replay: a replay is over within a second, and the robot's
own repeats come at 1 Hz."""
MOST: Final = 100
"""The greatest number of robots remembered; no site has more. Beyond this number the robot heard first
is forgotten."""


def noted(own: Mapping[str, str], asked: LiftRequested | EndRequested) -> Mapping[str, str]:
    """Note a robot's own request in the table, which maps a session to its destination."""
    others = {session: floor for session, floor in own.items() if session != asked.session_id}
    if isinstance(asked, EndRequested):
        return others
    if len(others) == MOST:
        del others[next(iter(others))]
    return {**others, asked.session_id: asked.destination}


def doubt(
    session: LiftSession, request: LiftRequested, own: str, held_open: bool, now: float
) -> Doubted | None:
    """Return the doubt about a request of this session; None if the request counts. `own`: the
    destination that the robot itself last requested."""
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
