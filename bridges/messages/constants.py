"""The constants of RMF's messages, with the numbers of the `.msg` files. Type hashes do not cover
constants.

The constants come from the same source as `definitions.py`. All releases have the same numbers. In
Jazzy, MODE_CLEANING is the last constant of RobotMode.
"""

from enum import IntEnum


class LiftRequestType(IntEnum):
    """The values of LiftRequest.request_type. LiftState has other numbers for modes: HUMAN is 1, AGV is
    2."""

    REQUEST_END_SESSION = 0
    REQUEST_AGV_MODE = 1
    REQUEST_HUMAN_MODE = 2


class LiftRequestDoor(IntEnum):
    """The values of LiftRequest.door_state."""

    DOOR_CLOSED = 0
    DOOR_OPEN = 2


class LiftDoor(IntEnum):
    """The values of LiftState.door_state."""

    DOOR_CLOSED = 0
    DOOR_MOVING = 1
    DOOR_OPEN = 2


class LiftMotion(IntEnum):
    """The values of LiftState.motion_state."""

    MOTION_STOPPED = 0
    MOTION_UP = 1
    MOTION_DOWN = 2
    MOTION_UNKNOWN = 3


class LiftMode(IntEnum):
    """The values of LiftState.current_mode and LiftState.available_modes."""

    MODE_UNKNOWN = 0
    MODE_HUMAN = 1
    MODE_AGV = 2
    MODE_FIRE = 3
    MODE_OFFLINE = 4
    MODE_EMERGENCY = 5


class DoorModeValue(IntEnum):
    """The values of DoorMode.value."""

    MODE_CLOSED = 0
    MODE_MOVING = 1
    MODE_OPEN = 2
    MODE_OFFLINE = 3
    MODE_UNKNOWN = 4


class ChargerStateValue(IntEnum):
    """The values of ChargerState.state. The number 0 has no meaning, so a message with default values
    is invalid."""

    CHARGER_IDLE = 1
    CHARGER_ASSIGNED = 2
    CHARGER_CHARGING = 3
    CHARGER_RELEASED = 4
    CHARGER_ERROR = 200


class WorkcellMode(IntEnum):
    """The values of DispenserState.mode and IngestorState.mode."""

    IDLE = 0
    BUSY = 1
    OFFLINE = 2


class WorkcellStatus(IntEnum):
    """The values of DispenserResult.status and IngestorResult.status."""

    ACKNOWLEDGED = 0
    SUCCESS = 1
    FAILED = 2


class RobotModeValue(IntEnum):
    """The values of RobotMode.mode."""

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
    """The values of ChargingAssignment.mode. The robot charges at the assigned waypoint, or waits at
    that waypoint until a charger is free."""

    MODE_CHARGE = 0
    MODE_WAIT = 1


class AlertTier(IntEnum):
    """The values of Alert.tier."""

    TIER_INFO = 0
    TIER_WARNING = 1
    TIER_ERROR = 2


class DiagnosticLevel(IntEnum):
    """The values of DiagnosticStatus.level."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
