"""Turns LiftRequests into events, refuses invalid requests, and turns reports into LiftStates."""

from collections.abc import Mapping

from bridges.kinds.lift.report import LiftReport
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import EndRequested, FromAdapter, LiftRequested
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.freshness import in_ns
from bridges.kinds.shared.names import check_length
from bridges.messages.definitions import (
    LiftMode,
    LiftRequest,
    LiftRequestDoor,
    LiftRequestType,
    LiftState,
    Time,
)
from bridges.messages.topics import ADAPTER_LIFT_REQUESTS

OWN_REQUESTS = ADAPTER_LIFT_REQUESTS.live()
"""The topic on which fleet adapters send requests to RMF's supervisor. On this topic our node hears the
robot that has the lift."""
AVAILABLE_MODES = (int(LiftMode.MODE_HUMAN), int(LiftMode.MODE_AGV))


def accept(request: LiftRequest, settings: LiftSettings) -> LiftRequested | EndRequested:
    """Turn a request into an event. Raises RequestRefused if the request is malformed or impossible.

    An END_SESSION counts with any floor and door, because fleet adapters send "" and 0
    (rmf_fleet_adapter RobotContext.cpp). At each state of a free lift, Jazzy's supervisor sends an
    END_SESSION without a session (lift_supervisor/Node.cpp). Such an END_SESSION ends nothing. An
    END_SESSION with DOOR_OPEN comes from a person (`rmf-bridge send`, rmf-web), because no node of RMF
    combines these two.

    A request for HUMAN mode needs no floor, because people then call the lift. A floor that is not
    served becomes "".
    """
    check_length(session_id=request.session_id)
    stamp = _stamp(request)
    if request.request_type == LiftRequestType.REQUEST_END_SESSION:
        by_person = request.door_state == LiftRequestDoor.DOOR_OPEN
        return EndRequested(request.session_id, stamp, by_person)
    if not request.session_id:
        raise RequestRefused("empty session_id", "a session needs a name")
    agv = request.request_type == LiftRequestType.REQUEST_AGV_MODE
    if not agv and request.request_type != LiftRequestType.REQUEST_HUMAN_MODE:
        raise RequestRefused("unknown request_type", str(request.request_type))
    if request.door_state not in set(LiftRequestDoor):
        raise RequestRefused("unknown door_state", str(request.door_state))
    floors, floor = settings.stops(), request.destination_floor
    if agv and floor not in floors:
        raise RequestRefused("floor not served", f"{floor!r} is not one of {', '.join(floors)}")
    return LiftRequested(request.session_id, agv, floor if floor in floors else "", stamp)


def accept_adapters(request: LiftRequest, settings: LiftSettings) -> FromAdapter:
    """Turn a fleet adapter's request to RMF's supervisor into an event. Raises RequestRefused."""
    return FromAdapter(accept(request, settings))


def _stamp(request: LiftRequest) -> int:
    """Return the request_time (ns). Return 0 for an impossible time, because an END with such a time
    must count too."""
    try:
        return in_ns(request.request_time)
    except RequestRefused:
        return 0


def device_name(message: LiftRequest | LiftState) -> str:
    """Return the name of the lift in a message."""
    return message.lift_name


def state_message(name: str, settings: LiftSettings, report: LiftReport, stamp: Time) -> LiftState:
    """Convert the report to RMF's message; `stamp` is the time of the inputs' reading."""
    return LiftState(
        lift_time=stamp,
        lift_name=name,
        available_floors=tuple(settings.stops()),
        current_floor=report.floor,
        destination_floor=report.destination,
        door_state=int(report.door),
        motion_state=int(report.motion),
        available_modes=AVAILABLE_MODES,
        current_mode=int(report.mode),
        session_id=report.session,
    )


def summary(report: LiftReport) -> Mapping[str, str]:
    """Summarise the report in one line, for a person."""
    door = report.door.name.removeprefix("DOOR_").lower()
    return {
        "mode": report.mode.name.removeprefix("MODE_"),
        "floor": report.floor or "?",
        "door": f"{door} (estimated)" if report.estimated else door,
        "motion": report.motion.name.removeprefix("MOTION_").lower(),
        "session": report.session or "-",
        "boarded": "yes" if report.boarded else "no",
        "destination": report.destination or "-",
        **({"waits": report.waits} if report.waits else {}),
    }
