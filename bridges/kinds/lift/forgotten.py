"""Sessions that RMF's lift supervisor forgets or ends: the robot's own requests still reach its lift.

A supervisor that restarts, or has missed an END, may serve another robot than the robot in the
car. From then on it drops the holder's requests and END (rmf_ros2, lift_supervisor/Node.cpp), and
this node refuses the other robot's requests: the holder would never leave the car. A restarted
supervisor also sends END for any session that the lift shows, while that session's robot goes on
asking. Rules:
1. A session is forgotten while the last request on `lift_requests` was for another session. It is no
   longer forgotten once `lift_requests` has a request for it, or the END of that other session.
2. A session whose robot may be inside is not ended by an END on `lift_requests` while that robot itself
   goes on asking. A robot goes on asking if its last request is at most ASKS_S old, it has sent no END
   since, and its last END is older than FORWARDED_S (the supervisor may be passing on a younger END).
   The session is disowned until `lift_requests` has a request for it. It ends when its robot sends END,
   or is silent for ASKS_S. A person's END always ends it.
3. Only while a session is forgotten or disowned, its own robot's requests on `adapter_lift_requests`
   count as if the supervisor had passed them on: they set mode and destination, and show that RMF is
   alive. That topic grants no session; during the grace it restores the session of a robot that may be
   inside.
4. A request counts if its stamp is newer than the requester's last stamp. The END of a forgotten robot
   counts only when it is heard twice, with no newer request between. An END without a stamp, as
   Jazzy's fleet adapters send it, is never too old.
5. A robot may have been left in the car if its session ended before OPEN was shown at its destination,
   or after a silence of its adapter: a killed fleet adapter sends END when it is back. Until IN_CAR_S
   after the robot's last message nobody else gets the lift, and its own request restores the session.
   The lift does not wait after a person's END, or for a robot never heard on `adapter_lift_requests`.
6. An END on `lift_requests` with a stamp from before the session's grant is old. It counts once it has
   been repeated for a second, because its sender's clock may differ.
7. After NAMED_AFTER_S a fault names the other robot, for which the supervisor asks.
"""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift.memory import ForgottenSession, LiftSession, OwnWords
from bridges.kinds.lift.signals import EndRequested, LiftRequested
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.freshness import SECOND_NS, Requester, Rules

NAMED_AFTER_S: Final = 3.0
"""At a handover the supervisor may ask for the next robot for this long without a fault."""
ASKS_S: Final = 5.0
"""After this silence five repeats are missing: states go out each second, and a fleet adapter repeats
its request at each LiftState (RobotContext.cpp, _check_lift_state)."""
IN_CAR_S: Final = 60.0
"""The longest wait (s) for a robot in the car. A killed fleet adapter has its robot on a task again
after 20 s (docs/how-to/ros.md)."""
FORWARDED_S: Final = 3.0
"""The greatest delay between the two topics: a supervisor passes END on at once."""
CLOSE_S: Final = 1e-6
"""The least difference (s) between two stamps of our time that a float can hold."""
CODE: Final = "FORGOTTEN_BY_SUPERVISOR"


def overruled(session: LiftSession, other: str, now: float) -> LiftSession:
    """Mark the session as forgotten, because `lift_requests` asks for another session."""
    before = session.forgotten or ForgottenSession(other, now)
    return replace(session, forgotten=replace(before, by=other))


def remembered(session: LiftSession, other: str) -> LiftSession:
    """Unmark the session after the END of another session on `lift_requests`."""
    forgotten = session.forgotten
    if forgotten is None or forgotten.by != other:
        return session
    return replace(session, forgotten=replace(forgotten, by="") if forgotten.disowned else None)


def disowned(session: LiftSession, now: float) -> LiftSession:
    """Mark the session as disowned: the supervisor has ended it although its robot goes on asking."""
    before = session.forgotten or ForgottenSession("", now)
    return replace(session, forgotten=replace(before, disowned=True))


def goes_on(session: LiftSession, now: float) -> bool:
    """May the robot be inside, and does the robot itself go on asking?"""
    robot = session.robot
    if not session.boarded or robot.ended_at >= robot.asked_at:
        return False
    return _has_just_asked(robot, now) and now >= robot.ended_at + FORWARDED_S


def lapses_at(session: LiftSession) -> float:
    """Return the time when a disowned session ends if its robot stays silent, else NEVER."""
    disowned = session.forgotten is not None and session.forgotten.disowned
    return session.robot.asked_at + ASKS_S if disowned else NEVER


def in_car_until(session: LiftSession, now: float) -> float:
    """Return the end of the wait for a robot that END now may leave in the car; AGES_AGO: no wait.

    The lift waits if OPEN was not shown at the robot's destination, or if the robot's adapter was
    silent, because then END comes from a new adapter, and no adapter has made the robot leave. The lift
    never waits for a robot that was not heard.
    """
    robot = session.robot
    rides = robot.asked_at > AGES_AGO and not (robot.told and _has_just_asked(robot, now))
    if not (session.boarded and rides):
        return AGES_AGO
    return max(robot.asked_at, robot.ended_at) + IN_CAR_S


def _has_just_asked(robot: OwnWords, now: float) -> bool:
    """Did the robot go on asking until now, or until its END?"""
    until = now if robot.ended_at < robot.asked_at else robot.ended_at
    return until < robot.asked_at + ASKS_S


def granted(session: LiftSession, stamp: int) -> LiftSession:
    """Note the stamp of the request that granted the session."""
    since = stamp / SECOND_NS - CLOSE_S if stamp else AGES_AGO
    return replace(session, ends=Requester(newest=since, newest_end=since))


def counts(session: LiftSession, ended: EndRequested, now: float) -> tuple[LiftSession, bool]:
    """Note an END of the session. Also return True if the END counts, False if it is too old."""
    if not ended.stamp:
        return session, True
    ends, counts = session.ends.hears(ended.stamp / SECOND_NS, 0.0, now, Rules(), ends=True)
    return (session if counts else replace(session, ends=ends)), counts


def heard(
    session: LiftSession, asked: LiftRequested | EndRequested, now: float
) -> tuple[LiftSession, bool]:
    """Note one of the robot's own requests. Also return True if it must be obeyed."""
    ends, robot = isinstance(asked, EndRequested), session.robot
    newer = asked.stamp > robot.stamp or (ends and asked.stamp == 0)
    if not newer:
        return session, False
    stamp = max(robot.stamp, asked.stamp)
    if isinstance(asked, EndRequested):
        ended_at = now if robot.ended_at <= robot.asked_at else robot.ended_at
        robot = replace(robot, stamp=stamp, ended_at=ended_at)
    else:
        opened = robot.opened and asked.destination == robot.floor
        robot = OwnWords(stamp, now, robot.ended_at, asked.destination, opened, told=opened)
    session = replace(session, robot=robot)
    forgotten = session.forgotten
    if forgotten is None:
        return session, False
    obeyed = forgotten.ended or forgotten.disowned or not ends
    return replace(session, forgotten=replace(forgotten, ended=ends)), obeyed


def named_at(session: LiftSession) -> float:
    """Return the time when the fault appears (s); NEVER if the session is not forgotten."""
    return session.forgotten.since + NAMED_AFTER_S if session.forgotten else NEVER


def fault(session: LiftSession, now: float) -> Fault | None:
    """Return the fault of the supervisor; None while a handover may still explain its requests."""
    if session.forgotten is None or now < named_at(session):
        return None
    other = session.forgotten.by
    does = f"asks for {other}" if other else "has ended it"
    return Fault(CODE, f"lift_requests {does} while {session.id} has the lift")
