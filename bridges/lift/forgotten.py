"""The holder that RMF's lift supervisor has forgotten: its own requests still reach its lift.

A supervisor that restarts, or that has missed an END, may take up a robot other than the one in the
car. From then on it drops the holder's requests and its END (rmf_ros2, lift_supervisor/Node.cpp), and
this node refuses the other robot's: nobody would ever leave the car. Rules:
1. A session is forgotten while the last request on `lift_requests` was for another session. It is no
   longer forgotten once `lift_requests` has a request for it, or the END of that other session.
2. Only while a session is forgotten, its own robot's requests on `adapter_lift_requests` count as if
   the supervisor had passed them on: mode, destination, and that RMF is alive. That topic never grants
   a session.
3. A request counts if its stamp is newer than the requester's last one. An END counts only when it is
   heard twice, with no newer request between. An END without a stamp, as Jazzy's fleet adapters send
   it, is not older than anything.
4. After NAMED_AFTER_S a fault names the robot that the supervisor asks for instead.
"""

from typing import Final

from msgspec.structs import replace

from bridges.core.decision import Fault
from bridges.core.durations import NEVER
from bridges.lift.memory import Forgotten, Session
from bridges.lift.signals import Ended, FromAdapter

NAMED_AFTER_S: Final = 3.0
"""At a handover the supervisor may ask for the next robot for a moment."""
CODE: Final = "FORGOTTEN_BY_SUPERVISOR"


def overruled(session: Session, other: str, now: float) -> Session:
    """The session once `lift_requests` asks for another one."""
    before = session.forgotten
    since, ended = (before.since, before.ended) if before else (now, False)
    return replace(session, forgotten=Forgotten(other, since, ended))


def remembered(session: Session, other: str) -> Session:
    """The session once `lift_requests` has had the END of another one."""
    forgotten = session.forgotten
    return replace(session, forgotten=None) if forgotten and forgotten.by == other else session


def heard(session: Session, event: FromAdapter) -> tuple[Session, bool]:
    """Take one of the robot's own requests. True if it is to be obeyed."""
    ends = isinstance(event.asked, Ended)
    newer = event.stamp > session.own_stamp or (ends and event.stamp == 0)
    if not newer:
        return session, False
    session = replace(session, own_stamp=max(session.own_stamp, event.stamp))
    forgotten = session.forgotten
    if forgotten is None:
        return session, False
    obeyed = forgotten.ended or not ends
    return replace(session, forgotten=replace(forgotten, ended=ends)), obeyed


def named_at(session: Session) -> float:
    """When the fault appears (s); NEVER if the session is not forgotten."""
    return session.forgotten.since + NAMED_AFTER_S if session.forgotten else NEVER


def fault(session: Session, now: float) -> Fault | None:
    """The session that the supervisor asks for instead, once it is too late for a handover."""
    if session.forgotten is None or now < named_at(session):
        return None
    other = session.forgotten.by
    return Fault(CODE, f"lift_requests asks for {other} while {session.id} has the lift")
