"""The holder whose session RMF's lift supervisor forgets or ends: its own words still reach its lift.

A supervisor that restarts, or that has missed an END, may take up a robot other than the one in the
car. From then on it drops the holder's requests and its END (rmf_ros2, lift_supervisor/Node.cpp), and
this node refuses the other robot's: nobody would ever leave the car. One that has just started also
sends END for whatever session the lift shows, while that session's robot goes on asking. Rules:
1. A session is forgotten while the last request on `lift_requests` was for another session. It is no
   longer forgotten once `lift_requests` has a request for it, or the END of that other session.
2. A session whose robot may be inside is not ended by an END on `lift_requests` while that robot itself
   goes on asking: its last request is not older than ASKS_S, it has sent no END since, and none
   FORWARDED_S ago (that is the END which the supervisor passes on). It is disowned, until
   `lift_requests` has a request for it. It ends when its robot sends END, or is silent for ASKS_S. A
   person's END always ends it.
3. Only while a session is forgotten or disowned, its own robot's requests on `adapter_lift_requests`
   count as if the supervisor had passed them on: mode, destination, and that RMF is alive. That topic
   never grants a session; in the grace it gives one back to a robot that may be in the car.
4. A request counts if its stamp is newer than the requester's last one. The END of a forgotten robot
   counts only when it is heard twice, with no newer request between. An END without a stamp, as
   Jazzy's fleet adapters send it, is not older than anything.
5. A robot whose session ended before OPEN was shown where it would go, or after its adapter had fallen
   silent, may have been left in the car: a fleet adapter that was killed sends END when it is back.
   Until IN_CAR_S after its last word nobody else gets the lift, and its own request gives it back. A
   robot that was never heard on `adapter_lift_requests` is not waited for, nor after a person's END.
6. An END on `lift_requests` that was sent before the session was granted is an old one. It counts once
   it has been repeated for a second: its sender's clock may be another.
7. After NAMED_AFTER_S a fault names the robot that the supervisor asks for instead.
"""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift.memory import ForgottenSession, LiftSession, OwnWords
from bridges.kinds.lift.signals import EndRequested, LiftRequested
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.freshness import SECOND_NS, Requester, Rules

NAMED_AFTER_S: Final = 3.0
"""At a handover the supervisor may ask for the next robot for a moment."""
ASKS_S: Final = 5.0
"""A fleet adapter asks once for each LiftState that it hears (RobotContext.cpp, _check_lift_state), and
states go out each second: five of its repeats are missing."""
IN_CAR_S: Final = 60.0
"""A killed fleet adapter has its robot on a task again 20 s after the kill (docs/how-to/ros.md)."""
FORWARDED_S: Final = 3.0
"""A supervisor passes END on at once; no topic is later than the other by more."""
CLOSE_S: Final = 1e-6
"""A float tells two present stamps apart from here on."""
CODE: Final = "FORGOTTEN_BY_SUPERVISOR"


def overruled(session: LiftSession, other: str, now: float) -> LiftSession:
    """The session once `lift_requests` asks for another one."""
    before = session.forgotten or ForgottenSession(other, now)
    return replace(session, forgotten=replace(before, by=other))


def remembered(session: LiftSession, other: str) -> LiftSession:
    """The session once `lift_requests` has had the END of another one."""
    forgotten = session.forgotten
    if forgotten is None or forgotten.by != other:
        return session
    return replace(session, forgotten=replace(forgotten, by="") if forgotten.disowned else None)


def disowned(session: LiftSession, now: float) -> LiftSession:
    """The session once the supervisor has ended it although its robot goes on asking."""
    before = session.forgotten or ForgottenSession("", now)
    return replace(session, forgotten=replace(before, disowned=True))


def goes_on(session: LiftSession, now: float) -> bool:
    """Does a robot that may be inside go on asking by itself?"""
    robot = session.robot
    if not session.boarded or robot.ended_at >= robot.asked_at:
        return False
    return _has_just_asked(robot, now) and now >= robot.ended_at + FORWARDED_S


def lapses_at(session: LiftSession) -> float:
    """When a disowned session ends by its robot's silence; NEVER if it is not disowned."""
    disowned = session.forgotten is not None and session.forgotten.disowned
    return session.robot.asked_at + ASKS_S if disowned else NEVER


def in_car_until(session: LiftSession, now: float) -> float:
    """Until when a robot that may have been left in the car is waited for, if its session ends now;
    AGES_AGO if it has told us itself that its ride is over.

    It has not if OPEN was not shown where it would go, or if its adapter had fallen silent: then nobody
    has made it leave, and END comes from a new adapter. A robot that was never heard is not waited for.
    """
    robot = session.robot
    rides = robot.asked_at > AGES_AGO and not (robot.told and _has_just_asked(robot, now))
    if not (session.boarded and rides):
        return AGES_AGO
    return max(robot.asked_at, robot.ended_at) + IN_CAR_S


def _has_just_asked(robot: OwnWords, now: float) -> bool:
    """Did it ask until now, or until its END?"""
    until = now if robot.ended_at < robot.asked_at else robot.ended_at
    return until < robot.asked_at + ASKS_S


def granted(session: LiftSession, stamp: int) -> LiftSession:
    """The session once it is granted by a request with this stamp."""
    since = stamp / SECOND_NS - CLOSE_S if stamp else AGES_AGO
    return replace(session, ends=Requester(newest=since, newest_end=since))


def counts(session: LiftSession, ended: EndRequested, now: float) -> tuple[LiftSession, bool]:
    """Take the session's END. False if it is older than the session."""
    if not ended.stamp:
        return session, True
    ends, counts = session.ends.hears(ended.stamp / SECOND_NS, 0.0, now, Rules(), ends=True)
    return (session if counts else replace(session, ends=ends)), counts


def heard(
    session: LiftSession, asked: LiftRequested | EndRequested, now: float
) -> tuple[LiftSession, bool]:
    """Take one of the robot's own requests. True if it is to be obeyed."""
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
    """When the fault appears (s); NEVER if the session is not forgotten."""
    return session.forgotten.since + NAMED_AFTER_S if session.forgotten else NEVER


def fault(session: LiftSession, now: float) -> Fault | None:
    """What the supervisor does instead, once it is too late for a handover."""
    if session.forgotten is None or now < named_at(session):
        return None
    other = session.forgotten.by
    does = f"asks for {other}" if other else "has ended it"
    return Fault(CODE, f"lift_requests {does} while {session.id} has the lift")
