"""RMF's messages as the `.msg` files define them. Each message has its fields in their order, with
their types.

This file and `constants.py` are the only table of messages in the program. The transports build their
own message types from the annotations of this table, field by field. The RIHS01 type hashes are
computed from this table too.

The table holds the messages of all releases of RMF. `releases.py` lists the messages and fields that a
release lacks.

Source: rmf_internal_msgs 3d4df02 (4.1.0), builtin_interfaces, std_msgs and diagnostic_msgs of ROS 2
Jazzy.

A `T[]` of ROS is a tuple here. So a message is hashable, comparable and immutable.
"""

from typing import Annotated, Final

from msgspec import Struct

from bridges.messages.constants import AlertTier as AlertTier
from bridges.messages.constants import ChargerStateValue as ChargerStateValue
from bridges.messages.constants import ChargingMode as ChargingMode
from bridges.messages.constants import DiagnosticLevel as DiagnosticLevel
from bridges.messages.constants import DoorModeValue as DoorModeValue
from bridges.messages.constants import LiftDoor as LiftDoor
from bridges.messages.constants import LiftMode as LiftMode
from bridges.messages.constants import LiftMotion as LiftMotion
from bridges.messages.constants import LiftRequestDoor as LiftRequestDoor
from bridges.messages.constants import LiftRequestType as LiftRequestType
from bridges.messages.constants import RobotModeValue as RobotModeValue
from bridges.messages.constants import WorkcellMode as WorkcellMode
from bridges.messages.constants import WorkcellStatus as WorkcellStatus

uint8 = Annotated[int, "uint8"]
byte = Annotated[int, "byte"]
uint32 = Annotated[int, "uint32"]
uint64 = Annotated[int, "uint64"]
int32 = Annotated[int, "int32"]
float32 = Annotated[float, "float32"]


class Time(Struct, frozen=True, gc=False):
    """builtin_interfaces/Time: seconds and nanoseconds since the epoch. Zero means never."""

    sec: int32 = 0
    nanosec: uint32 = 0


class Duration(Struct, frozen=True, gc=False):
    """builtin_interfaces/Duration: the sum of `sec` (s) and `nanosec` (ns). Only `sec` may be
    negative."""

    sec: int32 = 0
    nanosec: uint32 = 0


# --- rmf_lift_msgs -----------------------------------------------------------------------------


class LiftRequest(Struct, frozen=True, gc=False):
    lift_name: str = ""
    request_time: Time = Time()
    session_id: str = ""
    request_type: uint8 = 0
    destination_floor: str = ""
    door_state: uint8 = 0


class LiftState(Struct, frozen=True, gc=False):
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


class DoorMode(Struct, frozen=True, gc=False):
    value: uint32 = 0


class DoorRequest(Struct, frozen=True, gc=False):
    request_time: Time = Time()
    requester_id: str = ""
    door_name: str = ""
    requested_mode: DoorMode = DoorMode()


class DoorState(Struct, frozen=True, gc=False):
    door_time: Time = Time()
    door_name: str = ""
    current_mode: DoorMode = DoorMode()


class Session(Struct, frozen=True, gc=False):
    request_time: Time = Time()
    requester_id: str = ""


class DoorSessions(Struct, frozen=True, gc=False):
    door_name: str = ""
    sessions: tuple[Session, ...] = ()


class SupervisorHeartbeat(Struct, frozen=True, gc=False):
    all_sessions: tuple[DoorSessions, ...] = ()


# --- rmf_charger_msgs --------------------------------------------------------------------------


class ChargerRequest(Struct, frozen=True, gc=False):
    charger_name: str = ""
    fleet_name: str = ""
    robot_name: str = ""
    start_timeout: Duration = Duration()
    request_id: str = ""


class ChargerCancel(Struct, frozen=True, gc=False):
    charger_name: str = ""
    request_id: str = ""


class ChargerState(Struct, frozen=True, gc=False):
    charger_time: Time = Time()
    state: uint32 = 0
    charger_name: str = ""
    error_message: str = ""
    request_id: str = ""
    robot_fleet: str = ""
    robot_name: str = ""
    time_to_fully_charged: Duration = Duration()


# --- rmf_dispenser_msgs, rmf_ingestor_msgs: equal fields, different names -----------------------


class DispenserRequestItem(Struct, frozen=True, gc=False):
    type_guid: str = ""
    quantity: int32 = 0
    compartment_name: str = ""


class DispenserRequest(Struct, frozen=True, gc=False):
    time: Time = Time()
    request_guid: str = ""
    target_guid: str = ""
    transporter_type: str = ""
    items: tuple[DispenserRequestItem, ...] = ()


class DispenserState(Struct, frozen=True, gc=False):
    time: Time = Time()
    guid: str = ""
    mode: int32 = 0
    request_guid_queue: tuple[str, ...] = ()
    seconds_remaining: float32 = 0.0


class DispenserResult(Struct, frozen=True, gc=False):
    time: Time = Time()
    request_guid: str = ""
    source_guid: str = ""
    status: uint8 = 0


class IngestorRequestItem(Struct, frozen=True, gc=False):
    type_guid: str = ""
    quantity: int32 = 0
    compartment_name: str = ""


class IngestorRequest(Struct, frozen=True, gc=False):
    time: Time = Time()
    request_guid: str = ""
    target_guid: str = ""
    transporter_type: str = ""
    items: tuple[IngestorRequestItem, ...] = ()


class IngestorState(Struct, frozen=True, gc=False):
    time: Time = Time()
    guid: str = ""
    mode: int32 = 0
    request_guid_queue: tuple[str, ...] = ()
    seconds_remaining: float32 = 0.0


class IngestorResult(Struct, frozen=True, gc=False):
    time: Time = Time()
    request_guid: str = ""
    source_guid: str = ""
    status: uint8 = 0


# --- rmf_fleet_msgs ----------------------------------------------------------------------------


class RobotMode(Struct, frozen=True, gc=False):
    mode: uint32 = 0
    mode_request_id: uint64 = 0
    performing_action: str = ""


class Location(Struct, frozen=True, gc=False):
    t: Time = Time()
    x: float32 = 0.0
    y: float32 = 0.0
    yaw: float32 = 0.0
    obey_approach_speed_limit: bool = False
    approach_speed_limit: float32 = 0.0
    level_name: str = ""
    index: uint64 = 0


class RobotState(Struct, frozen=True, gc=False):
    """The state of one robot. `battery_percent` is from 0 to 100."""

    name: str = ""
    model: str = ""
    task_id: str = ""
    seq: uint64 = 0
    mode: RobotMode = RobotMode()
    battery_percent: float32 = 0.0
    location: Location = Location()
    path: tuple[Location, ...] = ()


class FleetState(Struct, frozen=True, gc=False):
    name: str = ""
    robots: tuple[RobotState, ...] = ()


class ChargingAssignment(Struct, frozen=True, gc=False):
    robot_name: str = ""
    waypoint_name: str = ""
    mode: uint8 = 0


class ChargingAssignments(Struct, frozen=True, gc=False):
    fleet_name: str = ""
    assignments: tuple[ChargingAssignment, ...] = ()


class EmergencySignal(Struct, frozen=True, gc=False):
    fleet_names: tuple[str, ...] = ()
    is_emergency: bool = False


# --- rmf_task_msgs, std_msgs -------------------------------------------------------------------


class AlertParameter(Struct, frozen=True, gc=False):
    name: str = ""
    value: str = ""


class Alert(Struct, frozen=True, gc=False):
    """A notice for people on RMF's dashboard. Each notice needs a new `id`."""

    id: str = ""
    title: str = ""
    subtitle: str = ""
    message: str = ""
    display: bool = True
    tier: uint8 = 0
    responses_available: tuple[str, ...] = ()
    alert_parameters: tuple[AlertParameter, ...] = ()
    task_id: str = ""


class Bool(Struct, frozen=True, gc=False):
    data: bool = False


class Header(Struct, frozen=True, gc=False):
    stamp: Time = Time()
    frame_id: str = ""


# --- diagnostic_msgs ---------------------------------------------------------------------------


class KeyValue(Struct, frozen=True, gc=False):
    key: str = ""
    value: str = ""


class DiagnosticStatus(Struct, frozen=True, gc=False):
    level: byte = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: tuple[KeyValue, ...] = ()


class DiagnosticArray(Struct, frozen=True, gc=False):
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
    | DispenserRequest
    | DispenserState
    | DispenserResult
    | IngestorRequest
    | IngestorState
    | IngestorResult
    | FleetState
    | ChargingAssignments
    | Alert
    | Bool
    | EmergencySignal
    | DiagnosticStatus
    | DiagnosticArray
)

OF_WORKCELLS: Final = frozenset({"rmf_dispenser_msgs", "rmf_ingestor_msgs"})
"""The packages with the messages of dispensers and ingestors. A machine with ROS needs these packages
only if it serves such a device."""
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
    DispenserRequestItem: "rmf_dispenser_msgs",
    DispenserRequest: "rmf_dispenser_msgs",
    DispenserState: "rmf_dispenser_msgs",
    DispenserResult: "rmf_dispenser_msgs",
    IngestorRequestItem: "rmf_ingestor_msgs",
    IngestorRequest: "rmf_ingestor_msgs",
    IngestorState: "rmf_ingestor_msgs",
    IngestorResult: "rmf_ingestor_msgs",
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
    """Return the annotation of each field, in the message's order. A number's annotation is an
    `Annotated`."""
    return dict(message_type.__annotations__)
