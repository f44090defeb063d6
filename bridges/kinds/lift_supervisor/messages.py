"""Turns LiftRequests and LiftStates into events, and refuses invalid messages and unknown lifts."""

from collections.abc import Mapping
from typing import Final

from msgspec.structs import replace

from bridges.kinds.lift_supervisor.report import SupervisorReport
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.kinds.lift_supervisor.signals import LiftStateHeard, RideEnded, RideRequested, Target
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.freshness import SECOND_NS, in_ns
from bridges.kinds.shared.names import check_length, check_listed
from bridges.messages.definitions import (
    LiftRequest,
    LiftRequestDoor,
    LiftRequestType,
    LiftState,
    Time,
)

MAX_FLOORS: Final = 1000


def accept_request(
    request: LiftRequest, settings: LiftSupervisorSettings, wall: float
) -> RideRequested | RideEnded:
    """Turn an adapter's request into an event. Raises RequestRefused. `wall`: our clock (s since the
    epoch).

    Of an END_SESSION only the session is read, because fleet adapters send END_SESSION without a floor
    (rmf_fleet_adapter RobotContext.cpp).
    """
    check_listed("lift", request.lift_name, settings.lifts)
    if not request.session_id:
        raise RequestRefused("empty session_id", "a session needs a name")
    check_length(session_id=request.session_id, destination_floor=request.destination_floor)
    stamp = in_ns(request.request_time) / SECOND_NS
    if request.request_type == LiftRequestType.REQUEST_END_SESSION:
        by_person = request.door_state == LiftRequestDoor.DOOR_OPEN
        return RideEnded(request.session_id, stamp, wall - stamp, by_person)
    if request.request_type not in set(LiftRequestType):
        raise RequestRefused("unknown request_type", str(request.request_type))
    if request.door_state not in set(LiftRequestDoor):
        raise RequestRefused("unknown door_state", str(request.door_state))
    agv = request.request_type == LiftRequestType.REQUEST_AGV_MODE
    if agv and not request.destination_floor:
        raise RequestRefused("no destination_floor", f"{request.session_id} wants to go nowhere")
    target = Target(request.request_type, request.destination_floor, request.door_state)
    return RideRequested(request.session_id, target, stamp, wall - stamp)


def accept_state(state: LiftState, settings: LiftSupervisorSettings, wall: float) -> LiftStateHeard:
    """Turn a lift's state into an event. Raises RequestRefused."""
    check_listed("lift", state.lift_name, settings.lifts)
    check_length(
        session_id=state.session_id,
        current_floor=state.current_floor,
        destination_floor=state.destination_floor,
        available_floors=max(state.available_floors, key=len, default=""),
    )
    if len(state.available_floors) > MAX_FLOORS:
        raise RequestRefused("impossible available_floors", f"{len(state.available_floors)} floors")
    return LiftStateHeard(
        session=state.session_id,
        floor=state.current_floor,
        destination=state.destination_floor,
        door=state.door_state,
        mode=state.current_mode,
        floors=state.available_floors,
    )


def device_name(message: LiftRequest | LiftState) -> str:
    """Return the name of the lift in a message."""
    return message.lift_name


def requester(event: RideRequested | RideEnded | LiftStateHeard) -> str:
    """Return the session of a request; "" for a state."""
    return "" if isinstance(event, LiftStateHeard) else event.session


def stamped(message: LiftRequest, time: Time) -> LiftRequest:
    """Add the time of sending to a message."""
    return replace(message, request_time=time)


def summary(report: SupervisorReport, now: float) -> Mapping[str, str]:
    """Summarise one lift in one line, for a person."""
    word = "ending" if report.ending else "holder"
    held = f"{report.holder} ({now - report.since:.0f} s)" if report.holder else "-"
    waiting = ", ".join(f"{session} ({now - since:.0f} s)" for session, since in report.waiting)
    said = {"session": report.shown or "-", word: held, "waiting": waiting or "-"}
    return {**said, "waits": report.waits} if report.waits else said
