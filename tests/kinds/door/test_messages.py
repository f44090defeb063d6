"""The daemon reads RMF's door requests, and writes RMF's door states."""

import pytest

from bridges.kinds.door import KIND, messages
from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.report import DoorReport
from bridges.kinds.door.signals import CloseRequested, OpenRequested
from bridges.kinds.shared.decision import Fault, RequestRefused
from bridges.messages import topics
from bridges.messages.definitions import DoorMode, DoorModeValue, DoorRequest, DoorState, Time
from tests.kinds.door.virtual import settings

SETTINGS = settings()


def request(mode: int, requester: str = "door_supervisor") -> DoorRequest:
    return DoorRequest(Time(7, 0), requester, "ward_door", DoorMode(mode))


def test_open_and_closed_can_be_requested() -> None:
    assert messages.accept(request(2), SETTINGS) == OpenRequested("door_supervisor")
    assert messages.accept(request(0), SETTINGS) == CloseRequested("door_supervisor")


@pytest.mark.parametrize("mode", [1, 3, 4, 5, 7, 2**32 - 1])
def test_no_other_mode_can_be_requested(mode: int) -> None:
    with pytest.raises(RequestRefused) as caught:
        messages.accept(request(mode), SETTINGS)
    assert (caught.value.kind, caught.value.detail) == (
        "mode that cannot be asked",
        f"requested_mode {mode} is neither OPEN (2) nor CLOSED (0)",
    )


def test_a_requester_id_has_a_maximum_length() -> None:
    with pytest.raises(RequestRefused) as caught:
        messages.accept(DoorRequest(requester_id="x" * 257, door_name="ward_door"), SETTINGS)
    assert caught.value.kind == "impossible requester_id"


def test_an_empty_request_closes_no_door() -> None:
    with pytest.raises(RequestRefused) as caught:
        messages.accept(DoorRequest(door_name="ward_door"), SETTINGS)
    assert caught.value.kind == "no requester"


@pytest.mark.parametrize("mode", list(DoorModeValue))
def test_a_door_state_has_the_mode_of_the_report_and_the_stamp_of_the_reading(
    mode: DoorModeValue,
) -> None:
    report = DoorReport(mode=mode, read_at=12.0, hold=True)
    assert messages.state_message("ward_door", SETTINGS, report, Time(3, 4)) == DoorState(
        door_time=Time(3, 4), door_name="ward_door", current_mode=DoorMode(int(mode))
    )


def test_the_summary_marks_what_is_only_estimated() -> None:
    seen = DoorReport(mode=DoorModeValue.MODE_OPEN, hold=True, faults=(Fault("X"),))
    guessed = DoorReport(mode=DoorModeValue.MODE_CLOSED, estimated=True)
    assert messages.summary(seen) == {"mode": "OPEN", "hold": "on"}
    assert messages.summary(guessed) == {"mode": "CLOSED", "hold": "off", "feedback": "estimated"}


def test_a_door_listens_to_the_supervisors_topic_and_takes_its_own_requests_only() -> None:
    assert list(KIND.requests) == [topics.DOOR_REQUESTS]
    assert KIND.device_name(request(2)) == "ward_door"
    assert KIND.device_name(DoorState(door_name="ward_door")) == "ward_door"
    assert KIND.limits(SETTINGS, {"opened": 0.5}) == DoorLimits(
        t=SETTINGS.limits, debounce={"opened": 0.5}
    )
