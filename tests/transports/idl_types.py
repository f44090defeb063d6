"""RMF's messages as cyclonedds types, written by hand without `bridges/transports/dds/idl.py`.

The fields come from the .msg files of rmf_internal_msgs 3d4df02, std_msgs and builtin_interfaces. So
these types look like those of another node on the wire. cyclonedds cannot read postponed annotations.
So this file does not import `annotations` from `__future__`.
"""

from dataclasses import dataclass
from typing import Any

from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import byte, float32, int32, sequence, uint8, uint32, uint64
from msgspec import Struct

# mypy knows nothing of cyclonedds.
# mypy: disable-error-code="misc, call-arg"


@annotations.final
@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@annotations.final
@dataclass
class Duration(IdlStruct, typename="builtin_interfaces.msg.dds_.Duration_"):
    sec: int32
    nanosec: uint32


@annotations.final
@dataclass
class LiftRequest(IdlStruct, typename="rmf_lift_msgs.msg.dds_.LiftRequest_"):
    lift_name: str
    request_time: Time
    session_id: str
    request_type: uint8
    destination_floor: str
    door_state: uint8


@annotations.final
@dataclass
class LiftState(IdlStruct, typename="rmf_lift_msgs.msg.dds_.LiftState_"):
    lift_time: Time
    lift_name: str
    available_floors: sequence[str]
    current_floor: str
    destination_floor: str
    door_state: uint8
    motion_state: uint8
    available_modes: sequence[uint8]
    current_mode: uint8
    session_id: str


@annotations.final
@dataclass
class DoorMode(IdlStruct, typename="rmf_door_msgs.msg.dds_.DoorMode_"):
    value: uint32


@annotations.final
@dataclass
class DoorRequest(IdlStruct, typename="rmf_door_msgs.msg.dds_.DoorRequest_"):
    request_time: Time
    requester_id: str
    door_name: str
    requested_mode: DoorMode


@annotations.final
@dataclass
class DoorState(IdlStruct, typename="rmf_door_msgs.msg.dds_.DoorState_"):
    door_time: Time
    door_name: str
    current_mode: DoorMode


@annotations.final
@dataclass
class Session(IdlStruct, typename="rmf_door_msgs.msg.dds_.Session_"):
    request_time: Time
    requester_id: str


@annotations.final
@dataclass
class DoorSessions(IdlStruct, typename="rmf_door_msgs.msg.dds_.DoorSessions_"):
    door_name: str
    sessions: sequence[Session]


@annotations.final
@dataclass
class SupervisorHeartbeat(IdlStruct, typename="rmf_door_msgs.msg.dds_.SupervisorHeartbeat_"):
    all_sessions: sequence[DoorSessions]


@annotations.final
@dataclass
class ChargerRequest(IdlStruct, typename="rmf_charger_msgs.msg.dds_.ChargerRequest_"):
    charger_name: str
    fleet_name: str
    robot_name: str
    start_timeout: Duration
    request_id: str


@annotations.final
@dataclass
class DispenserRequestItem(IdlStruct, typename="rmf_dispenser_msgs.msg.dds_.DispenserRequestItem_"):
    type_guid: str
    quantity: int32
    compartment_name: str


@annotations.final
@dataclass
class DispenserRequest(IdlStruct, typename="rmf_dispenser_msgs.msg.dds_.DispenserRequest_"):
    time: Time
    request_guid: str
    target_guid: str
    transporter_type: str
    items: sequence[DispenserRequestItem]


@annotations.final
@dataclass
class DispenserState(IdlStruct, typename="rmf_dispenser_msgs.msg.dds_.DispenserState_"):
    time: Time
    guid: str
    mode: int32
    request_guid_queue: sequence[str]
    seconds_remaining: float32


@annotations.final
@dataclass
class DispenserResult(IdlStruct, typename="rmf_dispenser_msgs.msg.dds_.DispenserResult_"):
    time: Time
    request_guid: str
    source_guid: str
    status: uint8


@annotations.final
@dataclass
class IngestorRequestItem(IdlStruct, typename="rmf_ingestor_msgs.msg.dds_.IngestorRequestItem_"):
    type_guid: str
    quantity: int32
    compartment_name: str


@annotations.final
@dataclass
class IngestorRequest(IdlStruct, typename="rmf_ingestor_msgs.msg.dds_.IngestorRequest_"):
    time: Time
    request_guid: str
    target_guid: str
    transporter_type: str
    items: sequence[IngestorRequestItem]


@annotations.final
@dataclass
class IngestorState(IdlStruct, typename="rmf_ingestor_msgs.msg.dds_.IngestorState_"):
    time: Time
    guid: str
    mode: int32
    request_guid_queue: sequence[str]
    seconds_remaining: float32


@annotations.final
@dataclass
class IngestorResult(IdlStruct, typename="rmf_ingestor_msgs.msg.dds_.IngestorResult_"):
    time: Time
    request_guid: str
    source_guid: str
    status: uint8


@annotations.final
@dataclass
class ChargerCancel(IdlStruct, typename="rmf_charger_msgs.msg.dds_.ChargerCancel_"):
    charger_name: str
    request_id: str


@annotations.final
@dataclass
class ChargerState(IdlStruct, typename="rmf_charger_msgs.msg.dds_.ChargerState_"):
    charger_time: Time
    state: uint32
    charger_name: str
    error_message: str
    request_id: str
    robot_fleet: str
    robot_name: str
    time_to_fully_charged: Duration


@annotations.final
@dataclass
class Bool(IdlStruct, typename="std_msgs.msg.dds_.Bool_"):
    data: bool


@annotations.final
@dataclass
class EmergencySignal(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.EmergencySignal_"):
    fleet_names: sequence[str]
    is_emergency: bool


@annotations.final
@dataclass
class RobotMode(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.RobotMode_"):
    mode: uint32
    mode_request_id: uint64
    performing_action: str


@annotations.final
@dataclass
class Location(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.Location_"):
    t: Time
    x: float32
    y: float32
    yaw: float32
    obey_approach_speed_limit: bool
    approach_speed_limit: float32
    level_name: str
    index: uint64


@annotations.final
@dataclass
class RobotState(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.RobotState_"):
    name: str
    model: str
    task_id: str
    seq: uint64
    mode: RobotMode
    battery_percent: float32
    location: Location
    path: sequence[Location]


@annotations.final
@dataclass
class FleetState(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.FleetState_"):
    name: str
    robots: sequence[RobotState]


@annotations.final
@dataclass
class ChargingAssignment(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.ChargingAssignment_"):
    robot_name: str
    waypoint_name: str
    mode: uint8


@annotations.final
@dataclass
class ChargingAssignments(IdlStruct, typename="rmf_fleet_msgs.msg.dds_.ChargingAssignments_"):
    fleet_name: str
    assignments: sequence[ChargingAssignment]


@annotations.final
@dataclass
class AlertParameter(IdlStruct, typename="rmf_task_msgs.msg.dds_.AlertParameter_"):
    name: str
    value: str


@annotations.final
@dataclass
class Alert(IdlStruct, typename="rmf_task_msgs.msg.dds_.Alert_"):
    id: str
    title: str
    subtitle: str
    message: str
    display: bool
    tier: uint8
    responses_available: sequence[str]
    alert_parameters: sequence[AlertParameter]
    task_id: str


@annotations.final
@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time
    frame_id: str


@annotations.final
@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key: str
    value: str


@annotations.final
@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@annotations.final
@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


def to_idl(value: Any) -> Any:
    """Return a message of this project as an object of the class with the same name in this file."""
    if isinstance(value, tuple):
        return [to_idl(element) for element in value]
    if not isinstance(value, Struct):
        return value
    members = [to_idl(getattr(value, name)) for name in value.__struct_fields__]
    return globals()[type(value).__name__](*members)
