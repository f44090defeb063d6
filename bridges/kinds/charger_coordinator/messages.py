"""Turns messages of fleets, stations, schedules and operators into events. Refuses invalid messages."""

import math
from collections.abc import Mapping
from datetime import datetime
from zoneinfo import ZoneInfo

from msgspec.structs import replace

from bridges.kinds.charger.messages import accept_request as accept_charger_request
from bridges.kinds.charger.refusals import refused
from bridges.kinds.charger.settings import ChargerSettings, RobotName
from bridges.kinds.charger_coordinator.keep import SITE
from bridges.kinds.charger_coordinator.report import SiteReport
from bridges.kinds.charger_coordinator.schedule import LocalTime
from bridges.kinds.charger_coordinator.settings import CoordinatorSettings, FleetSettings
from bridges.kinds.charger_coordinator.signals import (
    ChargerStateHeard,
    ChargeUnwanted,
    ChargeWanted,
    Dedicated,
    FleetSeen,
    ReceiverHeard,
    Sighting,
    is_dispatched,
)
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.kind import RefusalAnswer
from bridges.kinds.shared.names import LONGEST_TEXT, check_length
from bridges.messages import definitions as d
from bridges.messages.definitions import Time
from bridges.messages.stamps import in_seconds
from bridges.messages.topics import CHARGER_REFUSALS

CHARGE = d.ChargingMode.MODE_CHARGE
CHARGES = (d.RobotModeValue.MODE_CHARGING, d.RobotModeValue.MODE_DOCKING)


def accept_fleet(state: d.FleetState, settings: CoordinatorSettings, wall: float) -> FleetSeen:
    """Turn a FleetState into an event. Robots that are not in the YAML are left out."""
    fleet = settings.fleets.get(state.name)
    if fleet is None:
        raise RequestRefused("fleet not ours", f"{state.name!r}")
    stations = (places[state.name] for places in settings.places().values())
    places = {*stations, *(robot.waits_at for robot in fleet.robots.values())}
    seen = tuple(
        _sighting(state.name, robot, fleet, places, settings.near_m)
        for robot in state.robots
        if robot.name in fleet.robots
    )
    return FleetSeen(seen, local_time(wall, settings.timezone))


def local_time(wall: float, timezone: str | None) -> LocalTime:
    """Return the local day and time of day.

    `wall`: s since the epoch. `timezone`: the zone's name; None for the machine's zone.
    """
    at = datetime.fromtimestamp(wall, ZoneInfo(timezone) if timezone else None)
    return LocalTime(at.weekday(), at.hour * 60 + at.minute)


def _sighting(
    fleet_name: str, robot: d.RobotState, fleet: FleetSettings, places: set[str], near_m: float
) -> Sighting:
    check_length(task_id=robot.task_id)
    return Sighting(
        RobotName(fleet_name, robot.name),
        charges=robot.mode.mode in CHARGES and not is_dispatched(robot.task_id),
        place=_nearest(robot.location, fleet, places, near_m),
        battery_percent=robot.battery_percent,
        task_id=robot.task_id,
    )


def _nearest(at: d.Location, fleet: FleetSettings, places: set[str], near_m: float) -> str | None:
    """Find the nearest of these waypoints; None if the nearest is farther away than `near_m`."""
    away = {
        name: math.dist((at.x, at.y), (waypoint.x, waypoint.y))
        for name, waypoint in fleet.waypoints.items()
        if name in places and waypoint.level == at.level_name
    }
    near = {name: metres for name, metres in away.items() if metres <= near_m}
    return min(near, key=lambda name: near[name], default=None)


def accept_state(
    state: d.ChargerState, settings: CoordinatorSettings, wall: float
) -> ChargerStateHeard | ReceiverHeard:
    """Turn the ChargerState of a station, or of a robot's receiver, into an event. Raises
    RequestRefused."""
    receiver_of = settings.rcus().get(state.charger_name)
    if receiver_of is None and state.charger_name not in settings.stations:
        raise RequestRefused("station not ours", f"{state.charger_name!r}")
    if state.state not in set(d.ChargerStateValue):
        raise RequestRefused("unknown state", f"{state.charger_name}: {state.state}")
    check_length(
        request_id=state.request_id, robot_fleet=state.robot_fleet, robot_name=state.robot_name
    )
    check_length(LONGEST_TEXT, error_message=state.error_message)
    if receiver_of is not None:
        failed = state.state == d.ChargerStateValue.CHARGER_ERROR
        return ReceiverHeard(receiver_of, state.error_message if failed else "")
    named = RobotName(state.robot_fleet, state.robot_name)
    return ChargerStateHeard(
        state.charger_name,
        d.ChargerStateValue(state.state),
        state.request_id,
        named if named.fleet and named.name else None,
        state.error_message,
        in_seconds(state.time_to_fully_charged),
    )


def accept_request(
    request: d.ChargerRequest, settings: CoordinatorSettings, wall: float
) -> ChargeWanted:
    """Turn an operator's request into an event. An empty charger_name means any suitable station."""
    check_length(charger_name=request.charger_name)
    asked = accept_charger_request(request, ChargerSettings())
    if asked.who not in settings.robots():
        raise RequestRefused("robot not ours", f"{asked.who} is in no fleet of the YAML")
    return ChargeWanted(asked.who, request.charger_name, asked.request_id, asked.start_timeout_s)


def accept_withdrawal(
    cancel: d.ChargerCancel, settings: CoordinatorSettings, wall: float
) -> ChargeUnwanted:
    """Turn an operator's withdrawal of a request into an event. Raises RequestRefused."""
    if not cancel.request_id:
        raise RequestRefused("empty request_id", "which request is withdrawn?")
    check_length(request_id=cancel.request_id)
    return ChargeUnwanted(cancel.request_id)


def accept_assignments(
    message: d.ChargingAssignments, settings: CoordinatorSettings, wall: float
) -> Dedicated:
    """Turn another node's charging assignments into an event. The event names the station of each of
    our robots, or "" for a robot without a station."""
    fleet, known = message.fleet_name, settings.robots()
    stations = {places.get(fleet): name for name, places in settings.places().items()}
    return Dedicated(
        tuple(
            (who, stations.get(one.waypoint_name, "") if one.mode == CHARGE else "")
            for one in message.assignments
            if (who := RobotName(fleet, one.robot_name)) in known
        )
    )


def subject(message: object) -> str:
    """Return the name of the only subject, the site. All messages are about the site, because one queue
    spans all its stations."""
    return SITE


def stamped(message: d.Message, time: Time) -> d.Message:
    """Add the time of sending to a message."""
    if isinstance(message, d.Alert):
        return replace(message, id=f"{message.id}/{time.sec}")
    return message


def summary(report: SiteReport, now: float) -> Mapping[str, str]:
    """Summarise the stations, the schedule, and the queue with its reasons."""
    return {
        **dict(report.stations),
        "assigns": report.assigns,
        **({"schedule": "; ".join(report.schedule)} if report.schedule else {}),
        "queue": "; ".join(report.queue) or "-",
        **({"did not come": ", ".join(map(str, report.absent))} if report.absent else {}),
    }


def answer(request: object, reason: str) -> RefusalAnswer | None:
    """Make the published answer to a refused ChargerRequest; None for other messages."""
    match request:
        case d.ChargerRequest():
            who, station, request_id = (
                RobotName(request.fleet_name, request.robot_name),
                request.charger_name,
                request.request_id,
            )
        case ChargeWanted():
            who, station, request_id = request.robot, request.station, request.request_id
        case _:
            return None
    refusal = refused(request_id, station or "any", who, reason)
    return RefusalAnswer(CHARGER_REFUSALS, refusal.message(), refusal.fields())
