"""RMF's door messages at the edge: which requests can be asked, and the report as a DoorState."""

from collections.abc import Mapping
from typing import Any

from bridges.core.decision import RequestRefused
from bridges.core.names import check_length
from bridges.door.report import DoorReport
from bridges.door.settings import DoorSettings
from bridges.door.signals import CloseRequested, OpenRequested
from bridges.rmf.definitions import DoorMode, DoorModeValue, DoorRequest, DoorState, Time


def accept(message: DoorRequest, settings: DoorSettings) -> OpenRequested | CloseRequested:
    """The event that this request is.

    Who asks does not matter to a door, but somebody always does: a request without a requester_id is
    a half-filled one, and its mode, 0 by default, would mean CLOSE.
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
        "mode that cannot be asked", f"requested_mode {mode}; only OPEN (2) and CLOSED (0) can be"
    )


def state_message(name: str, settings: Any, report: DoorReport, stamp: Time) -> DoorState:
    """What RMF is told. `stamp`: when the door was last read."""
    return DoorState(door_time=stamp, door_name=name, current_mode=DoorMode(int(report.mode)))


def summary(report: DoorReport) -> Mapping[str, str]:
    """For the log line, the status file and `watch`: RMF's words, without their prefix."""
    words = {"mode": report.mode.name.removeprefix("MODE_"), "hold": "on" if report.hold else "off"}
    return {**words, "feedback": "estimated"} if report.estimated else words
