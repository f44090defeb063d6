"""Sessions that RMF's lift supervisor forgets or ends, although their robot continues to send requests.

A supervisor that restarts, or that has missed an END, may serve another robot than the robot in the
car. From then on the supervisor drops the requests and the END of the robot in the car (rmf_ros2,
lift_supervisor/Node.cpp), and this node refuses the other robot's requests. The robot in the car would
never get out. A restarted supervisor also sends END for any session that the lift shows, even if that
session's robot goes on asking.

Rules:
1. A session is marked as forgotten if the last request on `lift_requests` was for another session. The
   mark is removed when `lift_requests` has a request for the forgotten session, or the END of that
   other session.
2. An END on `lift_requests` does not end the session of a robot that may be inside and goes on asking.
   A robot goes on asking under three conditions. Its last request is at most ASKS_S old. It has sent no
   END after that request. Its last END is older than FORWARDED_S. The last condition is needed because
   the supervisor may only pass on a younger END of the robot. The session is then disowned until
   `lift_requests` has a request for the session. A disowned session ends when its robot sends END, or
   is silent for ASKS_S. A person's END always ends the session.
3. Requests of the session's own robot on `adapter_lift_requests` count only if the session is forgotten
   or disowned. They then count as if the supervisor had passed them on: they set mode and destination,
   and show that RMF is alive. A request on `adapter_lift_requests` grants no session. But during the
   grace after END it restores the session of a robot that may be inside.
4. A request counts if its stamp is newer than the requester's last stamp. Older stamps count too when
   they have risen for REPLAY_S (FRESHNESS-5), because the clock of the robot's adapter may have been
   set back. The END of a forgotten robot counts only when it is heard twice, with no newer request
   between. Jazzy's fleet adapters send END without a stamp; such an END is never too old.
5. A robot may be left in the car in two cases: its session ended before OPEN was shown at its
   destination, or its adapter was silent before the END. A killed fleet adapter sends END when it is
   back. Until IN_CAR_S after the robot's last message nobody else gets the lift, and the robot's own
   request restores the session. The lift does not wait after a person's END. The lift does not wait for
   a robot that was never heard asking on `adapter_lift_requests` either.
6. An END on `lift_requests` is old if its stamp is earlier than the stamp of the request that got the
   session. An old END counts only after it has been repeated for a second, because its sender's clock
   may differ.
7. If the mark lasts for NAMED_AFTER_S, a fault names the session for which the supervisor asks.
"""

from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift.memory import ForgottenSession, LiftSession, OwnWords
from bridges.kinds.lift.signals import EndRequested, LiftRequested
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.freshness import SECOND_NS, Requester, Rules

NAMED_AFTER_S: Final = 3.0
"""The time (s) after which a forgotten session is shown as a fault. In a normal handover the supervisor
asks for the next robot for less time."""
ASKS_S: Final = 5.0
"""The longest silence (s) of a robot that goes on asking: five missing repeats. A LiftState goes out
each second, and a fleet adapter repeats its request at each LiftState (RobotContext.cpp,
_check_lift_state)."""
IN_CAR_S: Final = 60.0
"""The longest wait (s) for a robot in the car. A killed fleet adapter gives its robot a task again
after 20 s (docs/how-to/ros.md)."""
FORWARDED_S: Final = 3.0
"""The longest time (s) from an END on `adapter_lift_requests` to the same END on `lift_requests`. A
supervisor passes an END on at once."""
CLOSE_S: Final = 1e-6
"""The accuracy (s) of a present-day stamp that is held as a float."""
CODE: Final = "FORGOTTEN_BY_SUPERVISOR"


def overruled(session: LiftSession, other: str, now: float) -> LiftSession:
    """Mark the session as forgotten, because `lift_requests` asks for another session."""
    before = session.forgotten or ForgottenSession(other, now)
    return replace(session, forgotten=replace(before, by=other))


def remembered(session: LiftSession, other: str) -> LiftSession:
    """Clear the mark of a forgotten session, because `lift_requests` has the END of the other session.
    A disowned session stays marked."""
    forgotten = session.forgotten
    if forgotten is None or forgotten.by != other:
        return session
    return replace(session, forgotten=replace(forgotten, by="") if forgotten.disowned else None)


def disowned(session: LiftSession, now: float) -> LiftSession:
    """Mark the session as disowned, because the supervisor has ended it although its robot goes on
    asking."""
    before = session.forgotten or ForgottenSession("", now)
    return replace(session, forgotten=replace(before, disowned=True))


def goes_on(session: LiftSession, now: float) -> bool:
    """Return whether the robot may be inside and goes on asking (rule 2)."""
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
    """Return the time until which the lift waits for a robot in the car, if its session ends now;
    AGES_AGO for no wait.

    The lift does not wait if the robot's adapter knows that the robot can get out. It knows this if it
    has sent a request after OPEN was shown at its destination. But if that adapter was silent before
    the END, the lift waits all the same. In that case the END comes from a restarted adapter, and no
    adapter has told the robot to leave. The lift never waits for a robot that was not heard on
    `adapter_lift_requests`.
    """
    robot = session.robot
    rides = robot.asked_at > AGES_AGO and not (robot.told and _has_just_asked(robot, now))
    if not (session.boarded and rides):
        return AGES_AGO
    return max(robot.asked_at, robot.ended_at) + IN_CAR_S


def _has_just_asked(robot: OwnWords, now: float) -> bool:
    """Return whether the robot sent a request in the last ASKS_S before now, or before its END."""
    until = now if robot.ended_at < robot.asked_at else robot.ended_at
    return until < robot.asked_at + ASKS_S


def granted(session: LiftSession, stamp: int) -> LiftSession:
    """Note the stamp of the request that got the session. An earlier END is old."""
    since = stamp / SECOND_NS - CLOSE_S if stamp else AGES_AGO
    return replace(session, ends=Requester(newest=since, newest_end=since))


def counts(session: LiftSession, ended: EndRequested, now: float) -> tuple[LiftSession, bool]:
    """Note an END of the session. Also return whether the END counts. An old END does not count (rule
    6)."""
    if not ended.stamp:
        return session, True
    ends, counts = session.ends.hears(ended.stamp / SECOND_NS, 0.0, now, Rules(), ends=True)
    return (session if counts else replace(session, ends=ends)), counts


def heard(
    session: LiftSession, asked: LiftRequested | EndRequested, now: float
) -> tuple[LiftSession, bool]:
    """Note one of the robot's own requests. Also return whether this request must be obeyed."""
    ends, robot = isinstance(asked, EndRequested), session.robot
    clock, counts = robot.clock, True
    if asked.stamp or not ends:
        clock, counts = clock.hears(asked.stamp / SECOND_NS, 0.0, now, Rules())
    robot = replace(robot, clock=clock)
    if not counts:
        return replace(session, robot=robot), False
    stamp = asked.stamp or robot.stamp
    if isinstance(asked, EndRequested):
        ended_at = now if robot.ended_at <= robot.asked_at else robot.ended_at
        robot = replace(robot, stamp=stamp, ended_at=ended_at)
    else:
        opened = robot.opened and asked.destination == robot.floor
        robot = OwnWords(stamp, now, robot.ended_at, asked.destination, opened, opened, clock)
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
    """Return the fault that RMF's supervisor serves another session; None before `named_at`."""
    if session.forgotten is None or now < named_at(session):
        return None
    other = session.forgotten.by
    does = f"asks for {other}" if other else "sends END"
    return Fault(CODE, f"lift_requests {does} while {session.id} has the lift")
