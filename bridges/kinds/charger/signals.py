"""A charger's sample, outputs and events: the interface of its core.

The simplest stations on HTTP give only their activity and an error text. Other controllers (CANopen,
Modbus, another make's JSON) also fill in `measured` and obey `power`.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled


class Activity(StrEnum):
    """A station's activity, as reported by itself. All names but UNKNOWN are also used in the YAML.

    STOPPING: told to stop or ramping down, and current still flows. RELEASED: disconnected from the
    robot, and not yet ready for another. UNKNOWN: a code that the YAML does not list.
    """

    IDLE = "idle"
    HANDSHAKE = "handshake"
    CHARGING = "charging"
    STOPPING = "stopping"
    RELEASED = "released"
    ERROR = "error"
    UNKNOWN = "unknown"


CURRENT_FLOWS = frozenset({Activity.CHARGING, Activity.STOPPING})
AT_FAULT = frozenset({Activity.ERROR, Activity.UNKNOWN})

FaultSide = Literal["", "station", "robot"]
"""The side at fault, as the controller itself diagnoses; "" if unknown."""


class Measured(msgspec.Struct, frozen=True):
    """A controller's reports beside its state. A value is None if the controller does not report it.

    `receiver_id`: the receiver on the pad, "" for none. `in_range`: a range check has shown the robot's
    coil in range for charging; False before the check. `range_ok`: the same for stations that report
    the range all the time, without a check. `at_height`: a movable pad is at its height for charging.
    `volts`, `amps`: at the battery. `battery_percent`: its charge. `temperatures`: name and °C.
    """

    receiver_id: str | None = None
    in_range: bool | None = None
    volts: float | None = None
    amps: float | None = None
    battery_percent: float | None = None
    time_to_full_s: float | None = None
    range_ok: bool | None = None
    at_height: bool | None = None
    temperatures: tuple[tuple[str, float], ...] = ()


class ChargerSample(msgspec.Struct, frozen=True):
    """One reading of one station.

    `code`: the vendor's number or word, for texts only. `error_text`: the station's own words,
    printable and of bounded length. `side`: the side at fault. `charges`: the station reports a charge
    in spite of its fault.
    """

    activity: Activity
    code: int | str
    error_text: str = ""
    measured: Measured = Measured()
    side: FaultSide = ""
    charges: bool = False


class ChargerOutputs(msgspec.Struct, frozen=True):
    """Every command to a station.

    `power`: may it energise? None: the driver sends no order, because we did not start the charge under
    way, or because the station does not answer.
    `clear_errors`, `range_checks`: how often we have ordered the station to clear its errors, and to
    check the range, since the daemon's start. These commands are not idempotent, so they are counts: a
    driver sends one command when a count rises, and never repeats it, even if it failed. A station
    that always knows the position ignores `range_checks`.
    """

    power: bool | None = None
    clear_errors: int = 0
    range_checks: int = 0


class ChargeRequested(msgspec.Struct, frozen=True):
    """A well-formed ChargerRequest for this charger; `start_timeout_s` 0 is the configured default.

    The session of a robot served without a request holds a ChargeRequested with an empty `request_id`.
    """

    request_id: str
    fleet: str
    robot: str
    start_timeout_s: float = 0.0

    @property
    def who(self) -> RobotName:
        """The request's robot."""
        return RobotName(self.fleet, self.robot)


class Cancelled(msgspec.Struct, frozen=True):
    """A ChargerCancel; an empty `request_id` cancels a charge without a request."""

    request_id: str


Event = Sampled[ChargerSample] | IoFailed | RivalSeen | OperatorReset | ChargeRequested | Cancelled
