"""Adapters' DoorRequests and the doors' DoorStates in: are they well formed, and for a door of ours?"""

from collections.abc import Mapping
from dataclasses import replace

from bridges.core.decision import RequestRefused
from bridges.core.freshness import in_ns
from bridges.core.names import check_length
from bridges.door_supervisor.core import REQUESTER_ID
from bridges.door_supervisor.report import DoorHoldReport
from bridges.door_supervisor.settings import Settings
from bridges.door_supervisor.signals import CloseRequested, OpenRequested, StateHeard
from bridges.rmf.definitions import DoorModeValue, DoorRequest, DoorState, SupervisorHeartbeat, Time


def accept_request(
    request: DoorRequest, settings: Settings, wall: float
) -> OpenRequested | CloseRequested:
    """The event that an adapter's request is; `wall` plays no part, as stamps are the requester's.

    A request without a requester_id is a half-filled one, and its mode, 0 by default, would mean
    CLOSE. One under our own name is what we send to the doors, come back by a renamed topic.
    """
    _check_door(request.door_name, settings)
    who = request.requester_id
    if not who:
        raise RequestRefused("no requester", "requester_id is empty")
    check_length(requester_id=who)
    if who == REQUESTER_ID:
        raise RequestRefused("a supervisor's request", "adapter_door_requests is for adapters")
    stamp = in_ns(request.request_time)
    mode = request.requested_mode.value
    if mode == DoorModeValue.MODE_OPEN:
        return OpenRequested(who, stamp)
    if mode == DoorModeValue.MODE_CLOSED:
        return CloseRequested(who, stamp)
    text = f"requested_mode {mode}; only OPEN (2) and CLOSED (0) can be"
    raise RequestRefused("mode that cannot be asked", text)


def accept_state(state: DoorState, settings: Settings, wall: float) -> StateHeard:
    """The event that a door's state is."""
    _check_door(state.door_name, settings)
    mode = state.current_mode.value
    if mode not in set(DoorModeValue):
        raise RequestRefused("unknown current_mode", str(mode))
    return StateHeard(DoorModeValue(mode))


def _check_door(name: str, settings: Settings) -> None:
    if not name:
        raise RequestRefused("empty door_name", "a door needs a name")
    check_length(door_name=name)
    if settings.doors is not None and name not in settings.doors:
        raise RequestRefused("not ours", f"{name!r} is none of {', '.join(settings.doors)}")


def device_name(message: DoorRequest | DoorState) -> str:
    """Which door a message is about."""
    return message.door_name


def stamped(
    message: DoorRequest | SupervisorHeartbeat, time: Time
) -> DoorRequest | SupervisorHeartbeat:
    """As it is sent at this time; the stamps of a heartbeat are its requesters'."""
    if isinstance(message, SupervisorHeartbeat):
        return message
    return replace(message, request_time=time)


def summary(report: DoorHoldReport, now: float) -> Mapping[str, str]:
    """What a person wants to read of one door, in a line."""
    mode = "-" if report.mode is None else report.mode.name.removeprefix("MODE_")
    held = ", ".join(f"{who} ({now - since:.0f} s)" for who, since in report.holders)
    return {"mode": mode, "held_by": held or "-"}
