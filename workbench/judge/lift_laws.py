"""The laws of a lift's node, as data."""

from typing import Final

from workbench.judge import lift_checks as checks
from workbench.judge.law import Law
from workbench.judge.lift_history import LiftHistory
from workbench.judge.shared_laws import ANSWERED, ONE, RATE, STAMP, fresh, named, stamped

A6: Final = "rmf_ros2 lift_supervisor/Node.cpp:58-140"
REQUEST_LIFT: Final = "rmf_ros2 phases/RequestLift.cpp:322-326"
CONTEXT: Final = "rmf_ros2 agv/RobotContext.cpp:1700-1735"

LAWS: Final[tuple[Law[LiftHistory], ...]] = (
    named(RATE, "L2.rate"),
    named(ANSWERED, "L2.answer"),
    named(ONE, "B0.one"),
    named(STAMP, "L3.stamp", check=stamped(checks.blind)),
    Law(
        "T1.numbers",
        "door_state, motion_state and modes are numbers of LiftState.msg",
        "RMF compares numbers: a number that it does not know never matches",
        "LiftState.msg",
        checks.numbers,
    ),
    Law(
        "L1.other",
        "A request for another lift changes nothing here",
        "All lifts share one topic: a node that ignores the name gives this lift to that robot",
        "LiftRequest.msg; sharp-rmf/low_level_lift did so",
        checks.other_lift,
    ),
    Law(
        "L1.bypass",
        "A session is granted on lift_requests, not on adapter_lift_requests",
        "Only the supervisor decides between two robots: without it both believe they have the lift",
        A6,
        checks.bypassed,
    ),
    Law(
        "L4.own",
        "session_id is the session_id of a request for this lift",
        "A robot enters only when it reads its own fleet/robot there",
        REQUEST_LIFT,
        checks.own_name,
    ),
    Law(
        "L4.grants",
        "A free lift in service shows the session of the robot that asks for it",
        "A fleet adapter has no timeout: it asks and waits for ever. AGV_MODE is 1 in a request",
        "rmf_ros2 phases/RequestLift.cpp; LiftRequest.msg",
        checks.grants,
    ),
    Law(
        "L5.ends",
        "END_SESSION of the holder ends the session, with an empty floor too, within 3 s",
        "Fleet adapters send END with no floor and door 0. Refused, the lift is lost to the next robot",
        CONTEXT,
        checks.ends,
    ),
    Law(
        "L5.foreign",
        "END_SESSION of another session changes nothing",
        "rmf-web sends END for every robot that it knows: a robot in the car must keep its lift",
        "rmf-web PR#808; " + A6,
        checks.ended_by_another,
    ),
    Law(
        "L4.ends",
        "A session ends only by its END_SESSION, not by a timeout, hazard, fault or other request",
        "The supervisor frees its slot only at END: the robot would wait for a lift that dropped it",
        "rmf_ros2#314, lift_supervisor/Node.cpp:58-104",
        checks.ended_unasked,
    ),
    Law(
        "L7.stopped",
        "DOOR_OPEN is shown only while the car stands",
        "A robot drives by door, floor and session only; it does not read motion_state",
        REQUEST_LIFT,
        checks.stopped,
        sensed=True,
    ),
    Law(
        "L7.floor",
        "DOOR_OPEN is shown only at a known floor",
        "Without a floor nothing proves where the door is",
        REQUEST_LIFT,
        checks.somewhere,
        sensed=True,
    ),
    Law(
        "L7.jump",
        "The door is not open at two floors within 1.5 s",
        "No car is that fast: one of the two floors was wrong, and a robot may have believed it",
        "follows from RequestLift.cpp: one state is enough",
        checks.no_jump,
        sensed=True,
    ),
    Law(
        "L7.fresh",
        "DOOR_OPEN is never a remembered state: its lift_time advances",
        "A controller that cannot be reached may have closed the door long ago",
        "LiftState.msg, lift_time",
        fresh(checks.opened),
        sensed=True,
    ),
    Law(
        "L7.agv",
        "A robot is let in only in MODE_AGV; in LiftState that is 2, and MODE_HUMAN is 1",
        "RMF does not read the mode, so OPEN must wait for it: else people call the car away",
        "LiftState.msg; " + REQUEST_LIFT,
        checks.in_agv,
        sensed=True,
    ),
    Law(
        "L7.holds",
        "The door stays OPEN for the session that called the lift, and does not flap",
        "A robot drives off at the first OPEN, and would be on its way when the door is not open",
        REQUEST_LIFT,
        checks.holds,
        sensed=True,
    ),
    Law(
        "L8.floor",
        "current_floor is one of available_floors, or empty",
        "RMF compares the names letter by letter",
        REQUEST_LIFT,
        checks.floors,
        sensed=True,
    ),
    Law(
        "L8.destination",
        "destination_floor is one that the holder asked for",
        "The supervisor repeats a request until it reads its floor there, and no other floor",
        A6,
        checks.destination,
    ),
    Law(
        "L9.unserved",
        "destination_floor is one of available_floors, or empty",
        "A request for a floor that is not served is refused, and moves the car nowhere",
        "LiftRequest.msg, destination_floor",
        checks.unserved,
    ),
    Law(
        "L10.board",
        "In FIRE, EMERGENCY or OFFLINE no robot is let in: OPEN is not shown to a session outside",
        "RMF lets a robot in on OPEN, floor and session, in every mode: a fire holds nobody back",
        REQUEST_LIFT,
        checks.lets_nobody_in,
    ),
    Law(
        "L10.grant",
        "In FIRE, EMERGENCY or OFFLINE no new session is granted",
        "A lift under recall is not for robots",
        "LiftState.msg, MODE_FIRE; follows from RequestLift.cpp",
        checks.grants_nothing,
    ),
    Law(
        "L12.false",
        "fire_alarm_trigger never carries `false` without an alarm to call off",
        "One `false` ends another source's alarm, and the robots go on with their tasks",
        "octarobotics/lci-rmf-adapter; rmf_ros2 FleetUpdateHandle::handle_emergency",
        checks.no_false,
    ),
    Law(
        "L12.retained",
        "fire_alarm_trigger is published TRANSIENT_LOCAL",
        "Fleet adapters subscribe transient-local: a volatile publisher never reaches them",
        "rmf_ros2#341, agv/Node.cpp:73-79",
        checks.retained,
    ),
)
