"""Sessions that RMF's lift supervisor forgets or ends: the robot's own requests still reach its lift.

If a supervisor restarts, or has missed an END, it may serve another robot than the robot in the car.
From then on the supervisor drops the holder's requests and END (rmf_ros2, lift_supervisor/Node.cpp),
and this node refuses the other robot's requests. The holder would never leave the car. A restarted
supervisor also sends END for any session that the lift shows, even if that session's robot goes on
asking. Rules:
1. A session is forgotten if the last request on `lift_requests` was for another session. It is no
   longer forgotten once `lift_requests` has a request for it, or the END of that other session.
2. A session whose robot may be inside is not ended by an END on `lift_requests` if that robot itself
   goes on asking. A robot goes on asking under three conditions: its last request is at most ASKS_S
   old, it has sent no END after that request, and its last END is older than FORWARDED_S (the
   supervisor may be passing on a younger END). The session is then disowned until `lift_requests` has a
   request for it. A disowned session ends when its robot sends END, or is silent for ASKS_S. A person's
   END always ends it.
3. If a session is forgotten or disowned, and only then, its own robot's requests on
   `adapter_lift_requests` count as if the supervisor had passed them on: they set mode and destination,
   and show that RMF is alive. That topic grants no session. But during the grace after END it restores
   the session of a robot that may be inside.
4. A request counts if its stamp is newer than the requester's last stamp. The END of a forgotten robot
   counts only when it is heard twice, with no newer request between. Jazzy's fleet adapters send END
   without a stamp; such an END is never too old.
5. A robot may have been left in the car if its session ended before OPEN was shown at its destination,
   or after a silence of its adapter: a killed fleet adapter sends END when it is back. Until IN_CAR_S
   after the robot's last message nobody else gets the lift, and the robot's own request restores the
   session. The lift does not wait after a person's END, or for a robot that was never heard on
   `adapter_lift_requests`.
6. An END on `lift_requests` with a stamp from before the session's grant is old. An old END counts only
   after it has been repeated for a second, because its sender's clock may differ.
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
"""The time (s) for which the supervisor may ask for the next robot without a fault, because of a normal
handover."""
ASKS_S: Final = 5.0
"""The silence (s) after which five repeats are missing. States go out each second, and a fleet adapter
repeats its request at each LiftState (RobotContext.cpp, _check_lift_state)."""
IN_CAR_S: Final = 60.0
"""The longest wait (s) for a robot in the car. A killed fleet adapter gives its robot a task again
after 20 s (docs/how-to/ros.md)."""
FORWARDED_S: Final = 3.0
"""The greatest delay (s) between the two topics. A supervisor passes END on at once."""
CLOSE_S: Final = 1e-6
"""The least difference (s) between two stamps of today's date that a float can hold."""
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
    """Return whether the robot may be inside and itself goes on asking."""
    robot = session.robot
    if not session.boarded or robot.ended_at >= robot.asked_at:
        return False
    return _has_just_asked(robot, now) and now >= robot.ended_at + FORWARDED_S


def lapses_at(session: LiftSession) -> float:
    """Return the time when a disowned session ends if its robot stays silent; NEVER for other
    sessions."""
    disowned = session.forgotten is not None and session.forgotten.disowned
    return session.robot.asked_at + ASKS_S if disowned else NEVER


def in_car_until(session: LiftSession, now: float) -> float:
    """Return the end of the wait for a robot that an END now may leave in the car; AGES_AGO if the lift
    does not wait.

    The lift waits if OPEN was not shown at the robot's destination. It also waits if the robot's
    adapter was silent: the END then comes from a new adapter, and no adapter has made the robot leave.
    The lift never waits for a robot that was not heard.
    """
    robot = session.robot
    rides = robot.asked_at > AGES_AGO and not (robot.told and _has_just_asked(robot, now))
    if not (session.boarded and rides):
        return AGES_AGO
    return max(robot.asked_at, robot.ended_at) + IN_CAR_S


def _has_just_asked(robot: OwnWords, now: float) -> bool:
    """Return whether the robot went on asking until now, or until its END."""
    until = now if robot.ended_at < robot.asked_at else robot.ended_at
    return until < robot.asked_at + ASKS_S


def granted(session: LiftSession, stamp: int) -> LiftSession:
    """Note the stamp of the request that granted the session."""
    since = stamp / SECOND_NS - CLOSE_S if stamp else AGES_AGO
    return replace(session, ends=Requester(newest=since, newest_end=since))


def counts(session: LiftSession, ended: EndRequested, now: float) -> tuple[LiftSession, bool]:
    """Note an END of the session. Also return whether the END counts; an END that is too old does
    not."""
    if not ended.stamp:
        return session, True
    ends, counts = session.ends.hears(ended.stamp / SECOND_NS, 0.0, now, Rules(), ends=True)
    return (session if counts else replace(session, ends=ends)), counts


def heard(
    session: LiftSession, asked: LiftRequested | EndRequested, now: float
) -> tuple[LiftSession, bool]:
    """Note one of the robot's own requests. Also return whether this request must be obeyed."""
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
    """Return the fault of the supervisor; None if a normal handover may still explain its requests."""
    if session.forgotten is None or now < named_at(session):
        return None
    other = session.forgotten.by
    does = f"asks for {other}" if other else "has ended this session"
    return Fault(CODE, f"lift_requests {does} while {session.id} has the lift")
