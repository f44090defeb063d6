"""Events of the coordinator's core: from fleets, stations, schedules and operators."""

import re
from typing import Final

import msgspec

from bridges.kinds.charger.settings import RobotName
from bridges.kinds.charger_coordinator.schedule import LocalTime
from bridges.kinds.shared.decision import OperatorReset
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import ChargerStateValue

_DISPATCHED: Final = re.compile(r"(?!charge)[^.]+\.dispatch-")
"""The beginning of a task id from RMF's dispatcher: CATEGORY.dispatch-NUMBER. The id of a charging task
that a fleet adapter starts itself is the word Charge and a UUID. (rmf_ros2 jazzy 7eef65a,
Dispatcher.cpp; rmf_task jazzy, ChargeBatteryFactory.cpp.)"""


def is_dispatched(task_id: str) -> bool:
    """Return whether this task came from RMF's dispatcher. Such a task is a patrol or a delivery, never
    a charge."""
    return _DISPATCHED.match(task_id) is not None


class Sighting(msgspec.Struct, frozen=True):
    """One robot of a FleetState.

    `charges`: the robot's mode is CHARGING or DOCKING, and its task did not come from RMF's dispatcher.
    `place`: the waypoint of our YAML where the robot stands; None if it stands at no such waypoint.
    """

    who: RobotName
    charges: bool
    place: str | None
    battery_percent: float
    task_id: str


class FleetSeen(msgspec.Struct, frozen=True):
    """A FleetState, reduced to the robots that the YAML names. `when`: the local time; None if not
    known."""

    robots: tuple[Sighting, ...]
    when: LocalTime | None = None


class ChargerStateHeard(msgspec.Struct, frozen=True):
    """A ChargerState. `robot`: None if the state names no robot. `full_in_s`: the time (s) until the
    robot is full; 0 if not known."""

    station: str
    state: ChargerStateValue
    request_id: str = ""
    robot: RobotName | None = None
    error: str = ""
    full_in_s: float = 0.0


class ReceiverHeard(msgspec.Struct, frozen=True):
    """A ChargerState from the daemon of a robot's own receiver, not from a station. `error`: "" without
    an error."""

    robot: RobotName
    error: str


class ChargeWanted(msgspec.Struct, frozen=True):
    """An operator wants this robot charged. `station`: the operator's choice, "" for any station."""

    robot: RobotName
    station: str
    request_id: str
    start_timeout_s: float


class ChargeUnwanted(msgspec.Struct, frozen=True):
    """An operator withdraws a request."""

    request_id: str


class Dedicated(msgspec.Struct, frozen=True):
    """Another node's charging assignments, as pairs of a robot and its station ("" without a
    station)."""

    stations: tuple[tuple[RobotName, str], ...]


Event = (
    FleetSeen
    | ChargerStateHeard
    | ReceiverHeard
    | ChargeWanted
    | ChargeUnwanted
    | Dedicated
    | MaySpeak
    | OperatorReset
    | Woken
)
