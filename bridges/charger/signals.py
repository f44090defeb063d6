"""What a charger's driver and its core say to each other in one scan, and the core's events.

A station that answers HTTP as the first contract does fills in the activity and the error's text only.
Richer controllers (CANopen, Modbus, another make's JSON) fill in `measured` and obey `power`.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from bridges.charger.settings import Robot
from bridges.core.decision import IoFailed, OperatorReset, RivalSeen, Sampled


class Activity(StrEnum):
    """What a station says that it is doing. The names are the YAML's, but for UNKNOWN.

    STOPPING: asked to end or ramping down while current still flows. RELEASED: disconnected from
    the robot, and not ready for another yet. UNKNOWN: a code that no list of the YAML names.
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
"""Whose fault an error is, by the controller's own diagnosis; "" where it does not say."""


class Measured(msgspec.Struct, frozen=True):
    """What a richer controller knows beside its state; None where it does not say.

    `receiver_id`: who is on the pad, "" for nobody. `in_range`: is the robot's coil where it can be
    charged; False too while that is being found out. `volts`, `amps`: at the battery.
    `battery_percent`: how full it is.
    """

    receiver_id: str | None = None
    in_range: bool | None = None
    volts: float | None = None
    amps: float | None = None
    battery_percent: float | None = None
    time_to_full_s: float | None = None


class ChargerSample(msgspec.Struct, frozen=True):
    """One reading of one station.

    `code`: the vendor's number or word, for texts only. `error_text`: the station's own words,
    printable and bounded. `side`: whose fault the error is. `charges`: it is at fault, and says all the
    same that it charges.
    """

    activity: Activity
    code: int | str
    error_text: str = ""
    measured: Measured = Measured()
    side: FaultSide = ""
    charges: bool = False


class ChargerOutputs(msgspec.Struct, frozen=True):
    """Everything that a station is told.

    `power`: whether it may energise; None leaves it as it is (a charge that we have not started, and
    a station that does not answer, are neither started nor stopped blindly).
    `clear_errors`, `range_checks`: how many clearings of its errors, and checks of the robot's
    position, were asked for since the daemon started. A driver sends one for a rise and never sends
    it again, whatever became of it: they are not idempotent, and as counts they may be written any
    number of times. A station that always knows the position has no use for `range_checks`.
    """

    power: bool | None = None
    clear_errors: int = 0
    range_checks: int = 0


class Requested(msgspec.Struct, frozen=True):
    """A ChargerRequest that is ours and well formed; `start_timeout_s` 0 is the configured default.

    A robot that is served though nobody asked has one without a `request_id`.
    """

    request_id: str
    fleet: str
    robot: str
    start_timeout_s: float = 0.0

    @property
    def who(self) -> Robot:
        """The robot that it is for."""
        return Robot(self.fleet, self.robot)


class Cancelled(msgspec.Struct, frozen=True):
    """A ChargerCancel; without a `request_id`, of what nobody asked for."""

    request_id: str


Event = Sampled[ChargerSample] | IoFailed | RivalSeen | OperatorReset | Requested | Cancelled
