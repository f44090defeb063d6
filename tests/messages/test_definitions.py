"""`definitions.py` and `releases.py`, compared with tables from the .msg files of each release.

The source is open-rmf/rmf_internal_msgs at 3d4df023bacaf7a091564e98f4aff0776f72a612 (4.1.0):
- every line of rmf_lift_msgs/msg, rmf_door_msgs/msg and rmf_charger_msgs/msg
- every line of rmf_dispenser_msgs/msg and rmf_ingestor_msgs/msg, where both kinds of workcell have the
  same constants
- Alert and AlertParameter of rmf_task_msgs/msg
- EmergencySignal, FleetState, ChargingAssignments and their parts of rmf_fleet_msgs/msg

Time, Duration, Bool and Header come from ROS 2 Jazzy's builtin_interfaces and std_msgs. diagnostic_msgs
comes from ros2/common_interfaces c0c0bc57f958eb54a142446f0c2a475754367eee.

Jazzy's differences come from the same files at tag 3.3.1, a351d51602383eb09a8138d302827a76241630a5.
Kilted's files have the content of 4.1.0. A comparison with branch kilted (3.5.0) at
c0f72ce5e2129411d2868414b25f6fab1460fcdb showed no difference.
"""

import typing
from enum import IntEnum
from typing import Any

import pytest

from bridges.messages import constants, releases
from bridges.messages import definitions as d
from bridges.messages.releases import Release

CONSTANTS = {
    d.LiftRequestType: {
        "REQUEST_END_SESSION": 0,
        "REQUEST_AGV_MODE": 1,
        "REQUEST_HUMAN_MODE": 2,
    },
    d.LiftRequestDoor: {"DOOR_CLOSED": 0, "DOOR_OPEN": 2},
    d.LiftDoor: {"DOOR_CLOSED": 0, "DOOR_MOVING": 1, "DOOR_OPEN": 2},
    d.LiftMotion: {
        "MOTION_STOPPED": 0,
        "MOTION_UP": 1,
        "MOTION_DOWN": 2,
        "MOTION_UNKNOWN": 3,
    },
    d.LiftMode: {
        "MODE_UNKNOWN": 0,
        "MODE_HUMAN": 1,
        "MODE_AGV": 2,
        "MODE_FIRE": 3,
        "MODE_OFFLINE": 4,
        "MODE_EMERGENCY": 5,
    },
    d.DoorModeValue: {
        "MODE_CLOSED": 0,
        "MODE_MOVING": 1,
        "MODE_OPEN": 2,
        "MODE_OFFLINE": 3,
        "MODE_UNKNOWN": 4,
    },
    d.ChargerStateValue: {
        "CHARGER_IDLE": 1,
        "CHARGER_ASSIGNED": 2,
        "CHARGER_CHARGING": 3,
        "CHARGER_RELEASED": 4,
        "CHARGER_ERROR": 200,
    },
    d.WorkcellMode: {"IDLE": 0, "BUSY": 1, "OFFLINE": 2},
    d.WorkcellStatus: {"ACKNOWLEDGED": 0, "SUCCESS": 1, "FAILED": 2},
    d.RobotModeValue: {
        "MODE_IDLE": 0,
        "MODE_CHARGING": 1,
        "MODE_MOVING": 2,
        "MODE_PAUSED": 3,
        "MODE_WAITING": 4,
        "MODE_EMERGENCY": 5,
        "MODE_GOING_HOME": 6,
        "MODE_DOCKING": 7,
        "MODE_ADAPTER_ERROR": 8,
        "MODE_CLEANING": 9,
        "MODE_PERFORMING_ACTION": 10,
        "MODE_ACTION_COMPLETED": 11,
    },
    d.ChargingMode: {"MODE_CHARGE": 0, "MODE_WAIT": 1},
    d.AlertTier: {"TIER_INFO": 0, "TIER_WARNING": 1, "TIER_ERROR": 2},
    d.DiagnosticLevel: {"OK": 0, "WARN": 1, "ERROR": 2, "STALE": 3},
}

FIELDS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec, uint32 nanosec",
    "rmf_lift_msgs/LiftRequest": (
        "string lift_name, builtin_interfaces/Time request_time, string session_id,"
        " uint8 request_type, string destination_floor, uint8 door_state"
    ),
    "rmf_lift_msgs/LiftState": (
        "builtin_interfaces/Time lift_time, string lift_name, string[] available_floors,"
        " string current_floor, string destination_floor, uint8 door_state, uint8 motion_state,"
        " uint8[] available_modes, uint8 current_mode, string session_id"
    ),
    "rmf_door_msgs/DoorMode": "uint32 value",
    "rmf_door_msgs/DoorRequest": (
        "builtin_interfaces/Time request_time, string requester_id, string door_name,"
        " rmf_door_msgs/DoorMode requested_mode"
    ),
    "rmf_door_msgs/DoorState": (
        "builtin_interfaces/Time door_time, string door_name, rmf_door_msgs/DoorMode current_mode"
    ),
    "rmf_door_msgs/Session": "builtin_interfaces/Time request_time, string requester_id",
    "rmf_door_msgs/DoorSessions": "string door_name, rmf_door_msgs/Session[] sessions",
    "rmf_door_msgs/SupervisorHeartbeat": "rmf_door_msgs/DoorSessions[] all_sessions",
    "rmf_charger_msgs/ChargerRequest": (
        "string charger_name, string fleet_name, string robot_name,"
        " builtin_interfaces/Duration start_timeout, string request_id"
    ),
    "rmf_charger_msgs/ChargerCancel": "string charger_name, string request_id",
    "rmf_charger_msgs/ChargerState": (
        "builtin_interfaces/Time charger_time, uint32 state, string charger_name,"
        " string error_message, string request_id, string robot_fleet, string robot_name,"
        " builtin_interfaces/Duration time_to_fully_charged"
    ),
    "rmf_dispenser_msgs/DispenserRequestItem": (
        "string type_guid, int32 quantity, string compartment_name"
    ),
    "rmf_dispenser_msgs/DispenserRequest": (
        "builtin_interfaces/Time time, string request_guid, string target_guid,"
        " string transporter_type, rmf_dispenser_msgs/DispenserRequestItem[] items"
    ),
    "rmf_dispenser_msgs/DispenserState": (
        "builtin_interfaces/Time time, string guid, int32 mode, string[] request_guid_queue,"
        " float32 seconds_remaining"
    ),
    "rmf_dispenser_msgs/DispenserResult": (
        "builtin_interfaces/Time time, string request_guid, string source_guid, uint8 status"
    ),
    "rmf_ingestor_msgs/IngestorRequestItem": (
        "string type_guid, int32 quantity, string compartment_name"
    ),
    "rmf_ingestor_msgs/IngestorRequest": (
        "builtin_interfaces/Time time, string request_guid, string target_guid,"
        " string transporter_type, rmf_ingestor_msgs/IngestorRequestItem[] items"
    ),
    "rmf_ingestor_msgs/IngestorState": (
        "builtin_interfaces/Time time, string guid, int32 mode, string[] request_guid_queue,"
        " float32 seconds_remaining"
    ),
    "rmf_ingestor_msgs/IngestorResult": (
        "builtin_interfaces/Time time, string request_guid, string source_guid, uint8 status"
    ),
    "std_msgs/Bool": "bool data",
    "rmf_fleet_msgs/EmergencySignal": "string[] fleet_names, bool is_emergency",
    "rmf_fleet_msgs/RobotMode": "uint32 mode, uint64 mode_request_id, string performing_action",
    "rmf_fleet_msgs/Location": (
        "builtin_interfaces/Time t, float32 x, float32 y, float32 yaw,"
        " bool obey_approach_speed_limit, float32 approach_speed_limit, string level_name,"
        " uint64 index"
    ),
    "rmf_fleet_msgs/RobotState": (
        "string name, string model, string task_id, uint64 seq, rmf_fleet_msgs/RobotMode mode,"
        " float32 battery_percent, rmf_fleet_msgs/Location location,"
        " rmf_fleet_msgs/Location[] path"
    ),
    "rmf_fleet_msgs/FleetState": "string name, rmf_fleet_msgs/RobotState[] robots",
    "rmf_fleet_msgs/ChargingAssignment": "string robot_name, string waypoint_name, uint8 mode",
    "rmf_fleet_msgs/ChargingAssignments": (
        "string fleet_name, rmf_fleet_msgs/ChargingAssignment[] assignments"
    ),
    "rmf_task_msgs/AlertParameter": "string name, string value",
    "rmf_task_msgs/Alert": (
        "string id, string title, string subtitle, string message, bool display, uint8 tier,"
        " string[] responses_available, rmf_task_msgs/AlertParameter[] alert_parameters,"
        " string task_id"
    ),
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "diagnostic_msgs/KeyValue": "string key, string value",
    "diagnostic_msgs/DiagnosticStatus": (
        "byte level, string name, string message, string hardware_id,"
        " diagnostic_msgs/KeyValue[] values"
    ),
    "diagnostic_msgs/DiagnosticArray": (
        "std_msgs/Header header, diagnostic_msgs/DiagnosticStatus[] status"
    ),
}


JAZZY: dict[str, str | None] = {
    "rmf_fleet_msgs/RobotMode": "uint32 mode, uint64 mode_request_id",
    "rmf_fleet_msgs/EmergencySignal": None,
    "rmf_task_msgs/Alert": None,
    "rmf_task_msgs/AlertParameter": None,
}
"""The message types whose fields in Jazzy differ from the table above. None means that Jazzy lacks the
message type."""
NOT_IN_JAZZY = {
    d.RobotModeValue: {"MODE_PERFORMING_ACTION", "MODE_ACTION_COMPLETED"},
    d.AlertTier: {"TIER_INFO", "TIER_WARNING", "TIER_ERROR"},
}
"""The constants that Jazzy lacks. All other constants have the same number in Jazzy's files."""
GOLDEN = {
    releases.KILTED: FIELDS,
    releases.JAZZY: {name: text for name, text in {**FIELDS, **JAZZY}.items() if text is not None},
}


def test_the_table_has_every_constant() -> None:
    enums = {kind for kind in vars(constants).values() if isinstance(kind, type)} - {IntEnum}
    assert enums == CONSTANTS.keys()
    assert enums == {kind for kind in vars(d).values() if isinstance(kind, type)} & enums


def test_no_constant_that_jazzy_lacks_is_sent() -> None:
    """We send none of the constants that Jazzy lacks. Only Alert uses AlertTier, and Jazzy lacks Alert
    too. Only RMF sends the robot modes that Jazzy lacks."""
    assert NOT_IN_JAZZY[d.AlertTier] == CONSTANTS[d.AlertTier].keys()
    assert not releases.JAZZY.has(d.Alert)
    ours = set(CONSTANTS[d.RobotModeValue]) - NOT_IN_JAZZY[d.RobotModeValue]
    assert sorted(d.RobotModeValue[name] for name in ours) == list(range(10))


@pytest.mark.parametrize("enum", CONSTANTS, ids=lambda enum: enum.__name__)
def test_every_constant_has_the_number_of_the_msg_file(enum: Any) -> None:
    assert {constant.name: constant.value for constant in enum} == CONSTANTS[enum]


@pytest.mark.parametrize("release", GOLDEN, ids=lambda release: release.name)
def test_every_message_has_the_fields_of_the_msg_file_of_its_release_in_order(
    release: Release,
) -> None:
    ours = {
        _ros_name(kind): ", ".join(f"{_ros_name(k)} {n}" for n, k in release.fields(kind).items())
        for kind in release.messages()
    }
    assert ours == GOLDEN[release]
    assert releases.RELEASES.keys() == {one.name for one in GOLDEN}


def _ros_name(kind: Any) -> str:
    if typing.get_origin(kind) is typing.Annotated:
        return str(kind.__metadata__[0])
    if typing.get_origin(kind) is tuple:
        return _ros_name(typing.get_args(kind)[0]) + "[]"
    if kind in (str, bool):
        return {str: "string", bool: "bool"}[kind]
    return f"{d.PACKAGES[kind]}/{kind.__name__}"
