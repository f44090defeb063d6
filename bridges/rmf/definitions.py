"""RMF's messages, as the `.msg` files define them: fields in their order, types and constants.

This is the only table of them. The transports make their own types from it (field by field,
from the annotations), and the RIHS01 type hashes are computed from it.

Source: rmf_internal_msgs 3d4df02 (4.1.0), builtin_interfaces, std_msgs and diagnostic_msgs of ROS 2
Jazzy.
A `T[]` of ROS is a tuple here, so that a message is a value: hashable, comparable, immutable.
"""

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Annotated, Final, cast

uint8 = Annotated[int, "uint8"]
byte = Annotated[int, "byte"]
uint32 = Annotated[int, "uint32"]
uint64 = Annotated[int, "uint64"]
int32 = Annotated[int, "int32"]
float32 = Annotated[float, "float32"]


@dataclass(frozen=True, slots=True)
class Time:
    """builtin_interfaces/Time: seconds and nanoseconds since the epoch; 0.0 means never."""

    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass(frozen=True, slots=True)
class Duration:
    """builtin_interfaces/Duration: sec may be negative, nanosec is added to it."""

    sec: int32 = 0
    nanosec: uint32 = 0


# --- rmf_lift_msgs -----------------------------------------------------------------------------


class LiftRequestType(IntEnum):
    """LiftRequest.request_type. Not LiftState's numbers: there HUMAN is 1 and AGV is 2."""

    REQUEST_END_SESSION = 0
    REQUEST_AGV_MODE = 1
    REQUEST_HUMAN_MODE = 2


class LiftRequestDoor(IntEnum):
    """LiftRequest.door_state."""

    DOOR_CLOSED = 0
    DOOR_OPEN = 2


class LiftDoor(IntEnum):
    """LiftState.door_state."""

    DOOR_CLOSED = 0
    DOOR_MOVING = 1
    DOOR_OPEN = 2


class LiftMotion(IntEnum):
    """LiftState.motion_state."""

    MOTION_STOPPED = 0
    MOTION_UP = 1
    MOTION_DOWN = 2
    MOTION_UNKNOWN = 3


class LiftMode(IntEnum):
    """LiftState.current_mode and available_modes."""

    MODE_UNKNOWN = 0
    MODE_HUMAN = 1
    MODE_AGV = 2
    MODE_FIRE = 3
    MODE_OFFLINE = 4
    MODE_EMERGENCY = 5


@dataclass(frozen=True, slots=True)
class LiftRequest:
    lift_name: str = ""
    request_time: Time = Time()
    session_id: str = ""
    request_type: uint8 = 0
    destination_floor: str = ""
    door_state: uint8 = 0


@dataclass(frozen=True, slots=True)
class LiftState:
    lift_time: Time = Time()
    lift_name: str = ""
    available_floors: tuple[str, ...] = ()
    current_floor: str = ""
    destination_floor: str = ""
    door_state: uint8 = 0
    motion_state: uint8 = 0
    available_modes: tuple[uint8, ...] = ()
    current_mode: uint8 = 0
    session_id: str = ""


# --- rmf_door_msgs -----------------------------------------------------------------------------


class DoorModeValue(IntEnum):
    """DoorMode.value."""

    MODE_CLOSED = 0
    MODE_MOVING = 1
    MODE_OPEN = 2
    MODE_OFFLINE = 3
    MODE_UNKNOWN = 4


@dataclass(frozen=True, slots=True)
class DoorMode:
    value: uint32 = 0


@dataclass(frozen=True, slots=True)
class DoorRequest:
    request_time: Time = Time()
    requester_id: str = ""
    door_name: str = ""
    requested_mode: DoorMode = DoorMode()


@dataclass(frozen=True, slots=True)
class DoorState:
    door_time: Time = Time()
    door_name: str = ""
    current_mode: DoorMode = DoorMode()


@dataclass(frozen=True, slots=True)
class Session:
    request_time: Time = Time()
    requester_id: str = ""


@dataclass(frozen=True, slots=True)
class DoorSessions:
    door_name: str = ""
    sessions: tuple[Session, ...] = ()


@dataclass(frozen=True, slots=True)
class SupervisorHeartbeat:
    all_sessions: tuple[DoorSessions, ...] = ()


# --- rmf_charger_msgs --------------------------------------------------------------------------


class ChargerStateValue(IntEnum):
    """ChargerState.state. There is no 0: a default-constructed message is invalid."""

    CHARGER_IDLE = 1
    CHARGER_ASSIGNED = 2
    CHARGER_CHARGING = 3
    CHARGER_RELEASED = 4
    CHARGER_ERROR = 200


@dataclass(frozen=True, slots=True)
class ChargerRequest:
    charger_name: str = ""
    fleet_name: str = ""
    robot_name: str = ""
    start_timeout: Duration = Duration()
    request_id: str = ""


@dataclass(frozen=True, slots=True)
class ChargerCancel:
    charger_name: str = ""
    request_id: str = ""


@dataclass(frozen=True, slots=True)
class ChargerState:
    charger_time: Time = Time()
    state: uint32 = 0
    charger_name: str = ""
    error_message: str = ""
    request_id: str = ""
    robot_fleet: str = ""
    robot_name: str = ""
    time_to_fully_charged: Duration = Duration()


# --- rmf_fleet_msgs ----------------------------------------------------------------------------


class RobotModeValue(IntEnum):
    """RobotMode.mode."""

    MODE_IDLE = 0
    MODE_CHARGING = 1
    MODE_MOVING = 2
    MODE_PAUSED = 3
    MODE_WAITING = 4
    MODE_EMERGENCY = 5
    MODE_GOING_HOME = 6
    MODE_DOCKING = 7
    MODE_ADAPTER_ERROR = 8
    MODE_CLEANING = 9
    MODE_PERFORMING_ACTION = 10
    MODE_ACTION_COMPLETED = 11


class ChargingMode(IntEnum):
    """ChargingAssignment.mode: charge at the waypoint, or wait there for a charger."""

    MODE_CHARGE = 0
    MODE_WAIT = 1


@dataclass(frozen=True, slots=True)
class RobotMode:
    mode: uint32 = 0
    mode_request_id: uint64 = 0
    performing_action: str = ""


@dataclass(frozen=True, slots=True)
class Location:
    t: Time = Time()
    x: float32 = 0.0
    y: float32 = 0.0
    yaw: float32 = 0.0
    obey_approach_speed_limit: bool = False
    approach_speed_limit: float32 = 0.0
    level_name: str = ""
    index: uint64 = 0


@dataclass(frozen=True, slots=True)
class RobotState:
    """`battery_percent`: 0-100."""

    name: str = ""
    model: str = ""
    task_id: str = ""
    seq: uint64 = 0
    mode: RobotMode = RobotMode()
    battery_percent: float32 = 0.0
    location: Location = Location()
    path: tuple[Location, ...] = ()


@dataclass(frozen=True, slots=True)
class FleetState:
    name: str = ""
    robots: tuple[RobotState, ...] = ()


@dataclass(frozen=True, slots=True)
class ChargingAssignment:
    robot_name: str = ""
    waypoint_name: str = ""
    mode: uint8 = 0


@dataclass(frozen=True, slots=True)
class ChargingAssignments:
    fleet_name: str = ""
    assignments: tuple[ChargingAssignment, ...] = ()


@dataclass(frozen=True, slots=True)
class EmergencySignal:
    fleet_names: tuple[str, ...] = ()
    is_emergency: bool = False


# --- rmf_task_msgs, std_msgs -------------------------------------------------------------------


class AlertTier(IntEnum):
    """Alert.tier."""

    TIER_INFO = 0
    TIER_WARNING = 1
    TIER_ERROR = 2


@dataclass(frozen=True, slots=True)
class AlertParameter:
    name: str = ""
    value: str = ""


@dataclass(frozen=True, slots=True)
class Alert:
    """What RMF's dashboard shows a person; its `id` is used once."""

    id: str = ""
    title: str = ""
    subtitle: str = ""
    message: str = ""
    display: bool = True
    tier: uint8 = 0
    responses_available: tuple[str, ...] = ()
    alert_parameters: tuple[AlertParameter, ...] = ()
    task_id: str = ""


@dataclass(frozen=True, slots=True)
class Bool:
    data: bool = False


@dataclass(frozen=True, slots=True)
class Header:
    stamp: Time = Time()
    frame_id: str = ""


# --- diagnostic_msgs ---------------------------------------------------------------------------


class DiagnosticLevel(IntEnum):
    """DiagnosticStatus.level."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True, slots=True)
class KeyValue:
    key: str = ""
    value: str = ""


@dataclass(frozen=True, slots=True)
class DiagnosticStatus:
    level: byte = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: tuple[KeyValue, ...] = ()


@dataclass(frozen=True, slots=True)
class DiagnosticArray:
    header: Header = Header()
    status: tuple[DiagnosticStatus, ...] = ()


Message = (
    LiftRequest
    | LiftState
    | DoorRequest
    | DoorState
    | SupervisorHeartbeat
    | ChargerRequest
    | ChargerCancel
    | ChargerState
    | FleetState
    | ChargingAssignments
    | Alert
    | Bool
    | EmergencySignal
    | DiagnosticStatus
    | DiagnosticArray
)

PACKAGES: Final[dict[type, str]] = {
    Time: "builtin_interfaces",
    Duration: "builtin_interfaces",
    LiftRequest: "rmf_lift_msgs",
    LiftState: "rmf_lift_msgs",
    DoorMode: "rmf_door_msgs",
    DoorRequest: "rmf_door_msgs",
    DoorState: "rmf_door_msgs",
    Session: "rmf_door_msgs",
    DoorSessions: "rmf_door_msgs",
    SupervisorHeartbeat: "rmf_door_msgs",
    ChargerRequest: "rmf_charger_msgs",
    ChargerCancel: "rmf_charger_msgs",
    ChargerState: "rmf_charger_msgs",
    RobotMode: "rmf_fleet_msgs",
    Location: "rmf_fleet_msgs",
    RobotState: "rmf_fleet_msgs",
    FleetState: "rmf_fleet_msgs",
    ChargingAssignment: "rmf_fleet_msgs",
    ChargingAssignments: "rmf_fleet_msgs",
    EmergencySignal: "rmf_fleet_msgs",
    AlertParameter: "rmf_task_msgs",
    Alert: "rmf_task_msgs",
    Bool: "std_msgs",
    Header: "std_msgs",
    KeyValue: "diagnostic_msgs",
    DiagnosticStatus: "diagnostic_msgs",
    DiagnosticArray: "diagnostic_msgs",
}
"""The ROS package that defines each type."""


def field_types(message_type: type) -> dict[str, type]:
    """Field -> type, in the message's order: as annotated, so a number is an `Annotated`."""
    return {field.name: cast(type, field.type) for field in fields(message_type)}
