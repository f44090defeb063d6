"""Turns DoorRequests into events, refuses invalid requests, and turns reports into DoorStates."""

from collections.abc import Mapping

from bridges.kinds.door.report import DoorReport
from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import CloseRequested, OpenRequested
from bridges.kinds.shared.decision import RequestRefused
from bridges.kinds.shared.names import check_length
from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest, DoorState, Time


def accept(message: DoorRequest, settings: DoorSettings) -> OpenRequested | CloseRequested:
    """Turn a request into an event. Raises RequestRefused if the request is malformed.

    A door obeys every requester. But a request without a requester_id is refused. The sender has left
    its fields empty, and the default mode, 0, would mean CLOSE.
    """
    if not message.requester_id:
        raise RequestRefused("no requester", "requester_id is empty")
    check_length(requester_id=message.requester_id)
    mode = message.requested_mode.value
    if mode == DoorModeValue.MODE_OPEN:
        return OpenRequested(message.requester_id)
    if mode == DoorModeValue.MODE_CLOSED:
        return CloseRequested(message.requester_id)
    raise RequestRefused(
        "mode that cannot be asked", f"requested_mode {mode} is neither OPEN (2) nor CLOSED (0)"
    )


def state_message(name: str, settings: object, report: DoorReport, stamp: Time) -> DoorState:
    """Convert the report to RMF's message; `stamp` is the time of the door's last reading."""
    return DoorState(door_time=stamp, door_name=name, current_mode=DoorMode(int(report.mode)))


def summary(report: DoorReport) -> Mapping[str, str]:
    """Summarise the report in one line, for the log, the status file and `watch`."""
    words = {"mode": report.mode.name.removeprefix("MODE_"), "hold": "on" if report.hold else "off"}
    words |= {"feedback": "estimated"} if report.estimated else {}
    return {**words, "waits": report.waits} if report.waits else words
