"""What passes between a charger's driver and its core in one scan, and the core's events.

The simplest stations on HTTP give only their activity and an error text. Other controllers (CANopen,
Modbus, another make's JSON) also fill in `measured` and obey `power`.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled


class Activity(StrEnum):
    """What a station says it is doing. The names are those of the YAML, except UNKNOWN.

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
"""Which side is at fault, by the controller's own diagnosis; "" if it does not say."""


class Measured(msgspec.Struct, frozen=True):
    """What a controller reports besides its state; None where it does not say.

    `receiver_id`: the receiver on the pad, "" if there is none. `in_range`: the robot's coil is where
    it can be charged; False too until a range check has shown that. `range_ok`: the same where the
    station says so all the time, without a check. `at_height`: a pad that the station moves is where
    it charges. `volts`, `amps`: at the battery. `battery_percent`: its charge. `temperatures`: name
    and °C.
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
    printable and of bounded length. `side`: which side is at fault. `charges`: the station is at fault
    and yet says that it charges.
    """

    activity: Activity
    code: int | str
    error_text: str = ""
    measured: Measured = Measured()
    side: FaultSide = ""
    charges: bool = False


class ChargerOutputs(msgspec.Struct, frozen=True):
    """Every command to a station.

    `power`: may it energise? None changes nothing: a charge that we did not start, or a station that
    does not answer, is neither started nor stopped blindly.
    `clear_errors`, `range_checks`: how many clearings of errors and checks of the robot's position
    have been ordered since the daemon started. The commands are not idempotent, so they are counts: a
    driver sends one command when a count rises, and never repeats it, even if it failed. A station
    that always knows the position ignores `range_checks`.
    """

    power: bool | None = None
    clear_errors: int = 0
    range_checks: int = 0


class ChargeRequested(msgspec.Struct, frozen=True):
    """A well-formed ChargerRequest for this charger; `start_timeout_s` 0 is the configured default.

    The session of a robot that is served without a request has one with an empty `request_id`.
    """

    request_id: str
    fleet: str
    robot: str
    start_timeout_s: float = 0.0

    @property
    def who(self) -> RobotName:
        """The robot that it is for."""
        return RobotName(self.fleet, self.robot)


class Cancelled(msgspec.Struct, frozen=True):
    """A ChargerCancel; an empty `request_id` cancels a charge without a request."""

    request_id: str


Event = Sampled[ChargerSample] | IoFailed | RivalSeen | OperatorReset | ChargeRequested | Cancelled
