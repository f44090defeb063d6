"""A charger's readings (samples), outputs and events, which are the interface of its decision core.

The simplest stations on HTTP give only their activity and an error text. Other controllers (CANopen,
Modbus, another maker's JSON) also obey `power`, and give measurements in `measured`.
"""

from enum import StrEnum
from typing import Literal

import msgspec

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled


class Activity(StrEnum):
    """A station's activity, as the station reports it. The YAML uses all these names except UNKNOWN.

    STOPPING: current still flows after an order to stop, or ramps down. RELEASED: disconnected from the
    robot, and not yet ready for another robot. UNKNOWN: a code that the YAML does not list.
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
"""The side at fault, as the controller itself diagnoses it; "" if the controller does not say."""


class Measured(msgspec.Struct, frozen=True):
    """The measurements that a controller reports in addition to its state. A value is None if the
    controller does not report it.

    `receiver_id`: the receiver on the pad, "" for none. `in_range`: the result of the last range check;
    False before the first. True means that the robot's coil is in range for charging. `range_ok`: the
    robot's coil is in range; only from a station that reports the range all the time, without a check.
    `at_height`: a movable pad is at its height for charging. `volts`, `amps`: the battery's voltage and
    current. `battery_percent`: the battery's charge. `temperatures`: pairs of a name and °C.
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

    `code`: the vendor's number or word for the state; only log and error texts use it. `error_text`:
    the station's own words, printable and of bounded length. `side`: the side at fault. `charges`: the
    station reports a charge in spite of its fault.
    """

    activity: Activity
    code: int | str
    error_text: str = ""
    measured: Measured = Measured()
    side: FaultSide = ""
    charges: bool = False


class ChargerOutputs(msgspec.Struct, frozen=True):
    """Every command to a station.

    `power`: whether the station may energise its pad. With None the driver sends no order, because we
    did not start the present charge, or because the station does not answer.

    `clear_errors`, `range_checks`: how often the core has ordered, since the daemon's start, to clear
    the errors and to check the range. Such a command would do harm if it were sent twice. Therefore
    these two outputs are counts: a driver sends one command when a count rises. It never repeats the
    command, even after a failure. A station that always knows the robot's position ignores
    `range_checks`.
    """

    power: bool | None = None
    clear_errors: int = 0
    range_checks: int = 0


class ChargeRequested(msgspec.Struct, frozen=True):
    """A well-formed ChargerRequest for this charger. If `start_timeout_s` is 0, the configured default
    applies.

    If the station serves a robot without a request, the core makes a ChargeRequested with an empty
    `request_id` for the session.
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
