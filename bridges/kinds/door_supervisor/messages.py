"""Turns DoorRequests and DoorStates into events, and refuses invalid messages and unknown doors."""

from collections.abc import Mapping

from msgspec.structs import replace

from bridges.kinds.door_supervisor.core import REQUESTER_ID
from bridges.kinds.door_supervisor.report import DoorHoldReport
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.kinds.door_supervisor.signals import DoorStateHeard, RequesterCloses, RequesterOpens
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.freshness import in_ns
from bridges.kinds.shared.names import check_length, check_listed
from bridges.messages.definitions import (
    DoorModeValue,
    DoorRequest,
    DoorState,
    SupervisorHeartbeat,
    Time,
)


def accept_request(
    request: DoorRequest, settings: DoorSupervisorSettings, wall: float
) -> RequesterOpens | RequesterCloses:
    """Turn an adapter's request into an event. Raises RequestRefused. `wall` is not used, because
    stamps are compared only with stamps of the same requester.

    A request without a requester_id is refused. The sender has left its fields empty, and the default
    mode, 0, would mean CLOSE. A request with our own requester_id is refused too. It is our own request
    to a door, which comes back to us because somebody has renamed a topic.
    """
    check_listed("door", request.door_name, settings.doors)
    who = request.requester_id
    if not who:
        raise RequestRefused("no requester", "requester_id is empty")
    check_length(requester_id=who)
    if who == REQUESTER_ID:
        raise RequestRefused("a supervisor's request", "adapter_door_requests is for adapters")
    stamp = in_ns(request.request_time)
    mode = request.requested_mode.value
    if mode == DoorModeValue.MODE_OPEN:
        return RequesterOpens(who, stamp)
    if mode == DoorModeValue.MODE_CLOSED:
        return RequesterCloses(who, stamp)
    text = f"requested_mode {mode} is neither OPEN (2) nor CLOSED (0)"
    raise RequestRefused("mode that cannot be asked", text)


def accept_state(state: DoorState, settings: DoorSupervisorSettings, wall: float) -> DoorStateHeard:
    """Turn a door's state into an event. Raises RequestRefused."""
    check_listed("door", state.door_name, settings.doors)
    mode = state.current_mode.value
    if mode not in set(DoorModeValue):
        raise RequestRefused("unknown current_mode", str(mode))
    return DoorStateHeard(DoorModeValue(mode))


def device_name(message: DoorRequest | DoorState) -> str:
    """Return the name of the door in a message."""
    return message.door_name


def requester(event: RequesterOpens | RequesterCloses | DoorStateHeard) -> str:
    """Return the sender of a request; "" for a state."""
    return "" if isinstance(event, DoorStateHeard) else event.requester


def stamped(
    message: DoorRequest | SupervisorHeartbeat, time: Time
) -> DoorRequest | SupervisorHeartbeat:
    """Add the time of sending to a message. A heartbeat stays unchanged, because it has no stamp of its
    own."""
    if isinstance(message, SupervisorHeartbeat):
        return message
    return replace(message, request_time=time)


def summary(report: DoorHoldReport, now: float) -> Mapping[str, str]:
    """Summarise one door in one line, for a person."""
    mode = "-" if report.mode is None else report.mode.name.removeprefix("MODE_")
    held = ", ".join(f"{who} ({now - since:.0f} s)" for who, since in report.holders)
    said = {"mode": mode, "held_by": held or "-"}
    return {**said, "waits": report.waits} if report.waits else said
