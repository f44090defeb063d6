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
        "a state",
        "RMF compares numbers. An unknown number never matches",
        "LiftState.msg",
        checks.numbers,
    ),
    Law(
        "L1.other",
        "A request for another lift changes nothing at this lift",
        "a request for another lift while this lift is free",
        "All lifts share one topic. A node that ignores the lift's name would give this lift to"
        " the robot",
        "LiftRequest.msg; sharp-rmf/low_level_lift did so",
        checks.other_lift,
    ),
    Law(
        "L1.bypass",
        "A session is granted on lift_requests, not on adapter_lift_requests",
        "the lift is free, and no supervisor forwards a fleet adapter's request for it",
        "Only the supervisor decides between two robots. Without a supervisor, both would use the lift",
        A6,
        checks.bypassed,
    ),
    Law(
        "L4.own",
        "session_id is the session_id of a request for this lift",
        "a session begins, in messages that include lift_requests",
        "A robot enters only if session_id is the robot's own name, fleet/robot",
        REQUEST_LIFT,
        checks.own_name,
    ),
    Law(
        "L4.grants",
        "A free lift in service (MODE_AGV or MODE_HUMAN) shows the session of the robot that asks"
        " for it",
        "a request for the free lift, in service",
        "A fleet adapter has no timeout and would wait for ever. A wrong number may be the cause:"
        " AGV_MODE is 1 in a request",
        "rmf_ros2 phases/RequestLift.cpp; LiftRequest.msg",
        checks.grants,
    ),
    Law(
        "L5.ends",
        "END_SESSION for the holder ends the session within 3 s, even if END_SESSION names no floor",
        "the first END_SESSION for the holder names no floor",
        "Fleet adapters send END without a floor. If a lift refuses END, no other robot can use"
        " the lift",
        CONTEXT,
        checks.ends,
    ),
    Law(
        "L5.foreign",
        "END_SESSION for a session that does not hold the lift changes nothing",
        "END_SESSION for another session while a robot has the lift",
        "rmf-web sends END for every known robot. A robot in the car must keep its lift",
        "rmf-web PR#808; " + A6,
        checks.ended_by_another,
    ),
    Law(
        "L4.ends",
        "A session ends only by its END_SESSION, not by a timeout, hazard, fault or other request",
        "in a session the car moves, a hazard comes, or another session requests the lift",
        "The supervisor repeats the requests of one session until END, even if the lift has"
        " dropped that session",
        "rmf_ros2#314, lift_supervisor/Node.cpp:58-104",
        checks.ended_unasked,
    ),
    Law(
        "L7.stopped",
        "DOOR_OPEN is shown only while the car stands",
        "a state says that the car goes up or down",
        "A robot drives by door, floor and session only; it does not read motion_state",
        REQUEST_LIFT,
        checks.stopped,
        sensed=True,
    ),
    Law(
        "L7.floor",
        "DOOR_OPEN is shown only at a known floor",
        "the door opens",
        "If the state shows no floor, nothing proves at which floor the door is open",
        REQUEST_LIFT,
        checks.somewhere,
        sensed=True,
    ),
    Law(
        "L7.jump",
        "The door is not open at one floor and, within 1.5 s, at another floor",
        "the door opens at a second floor",
        "No car is so fast. One of the two floors was wrong, and a robot may have driven out there",
        "follows from RequestLift.cpp, where one matching state lets the robot drive",
        checks.no_jump,
        sensed=True,
    ),
    Law(
        "L7.fresh",
        "DOOR_OPEN is always a new reading, never an old one: its lift_time advances",
        "the door is OPEN for more than 5 s",
        "A controller that cannot be reached may have closed the door long ago",
        "LiftState.msg, lift_time",
        fresh(),
        sensed=True,
    ),
    Law(
        "L7.agv",
        "A robot is let in only in MODE_AGV, which is 2 in LiftState; MODE_HUMAN is 1",
        "the door opens for a robot that boards",
        "RMF does not read the mode, so OPEN must wait for AGV mode. Otherwise people could call"
        " the car away",
        "LiftState.msg; " + REQUEST_LIFT,
        checks.in_agv,
        sensed=True,
    ),
    Law(
        "L7.holds",
        "The door stays OPEN in AGV mode for a session that asks for its floor, and does not close and"
        " open again and again",
        "two states in a row show the door OPEN at the robot's floor, before the robot asks for another"
        " floor or the session ends",
        "A robot drives off at the first OPEN. It would meet a closing door",
        REQUEST_LIFT,
        checks.holds,
        sensed=True,
    ),
    Law(
        "L8.floor",
        "current_floor is one of available_floors, or empty",
        "a state with current_floor and available_floors",
        "RMF compares the names letter by letter",
        REQUEST_LIFT,
        checks.floors,
        sensed=True,
    ),
    Law(
        "L8.destination",
        "destination_floor is a floor that the holder asked for",
        "a state with a destination, in a session seen from its beginning",
        "The supervisor repeats a request until destination_floor is the requested floor",
        A6,
        checks.destination,
    ),
    Law(
        "L9.unserved",
        "destination_floor is one of available_floors, or empty",
        "a request for a floor that is not served; the holder sends it, or the lift is free",
        "A request for a floor that is not served must be refused, and must not move the car",
        "LiftRequest.msg, destination_floor",
        checks.unserved,
    ),
    Law(
        "L10.board",
        "In FIRE, EMERGENCY or OFFLINE no robot is let in: OPEN is not shown to a robot outside"
        " the car",
        "FIRE, EMERGENCY or OFFLINE begins while a robot that has not boarded has the session",
        "RMF lets a robot in if OPEN, floor and session match. The mode FIRE does not stop the robot",
        REQUEST_LIFT,
        checks.lets_nobody_in,
    ),
    Law(
        "L10.grant",
        "In FIRE, EMERGENCY or OFFLINE no new session is granted",
        "a request for the free lift in FIRE, EMERGENCY or OFFLINE",
        "A lift under recall is not for robots",
        "LiftState.msg, MODE_FIRE; follows from RequestLift.cpp",
        checks.grants_nothing,
    ),
    Law(
        "L12.false",
        "`false` is published on fire_alarm_trigger only to end an alarm",
        "a `false` that ends an alarm, if the wire names its sender, with only one lift on the graph",
        "One `false` ends another source's alarm, and the robots go on with their tasks",
        "octarobotics/lci-rmf-adapter; rmf_ros2 FleetUpdateHandle::handle_emergency",
        checks.no_false,
    ),
    Law(
        "L12.retained",
        "fire_alarm_trigger is published TRANSIENT_LOCAL",
        "a publisher of fire_alarm_trigger, with only one lift on the graph",
        "Fleet adapters subscribe transient-local. A volatile publisher never reaches an adapter",
        "rmf_ros2#341, agv/Node.cpp:73-79",
        checks.retained,
    ),
)
