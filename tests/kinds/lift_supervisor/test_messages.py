"""How the supervisor reads or refuses the messages of fleet adapters. One test checks the status
file."""

import pytest
from msgspec.structs import replace

from bridges.kinds.lift_supervisor import messages
from bridges.kinds.lift_supervisor.report import SupervisorReport
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.kinds.lift_supervisor.signals import LiftStateHeard, RideEnded, RideRequested, Target
from bridges.kinds.shared.decision import Fault, RequestRefused
from bridges.messages.definitions import LiftRequest, LiftState, Time

ANY = LiftSupervisorSettings()
AGV = LiftRequest("Lift1", Time(100, 500_000_000), "fleet/a", 1, "L3", 2)


def test_the_request_of_an_adapter_becomes_an_event_with_stamp_and_age() -> None:
    asked = RideRequested("fleet/a", Target(1, "L3", 2), 100.5, 0.5)
    assert messages.accept_request(AGV, ANY, 101.0) == asked


def test_human_mode_may_be_requested_without_a_floor() -> None:
    human = replace(AGV, request_type=2, destination_floor="", door_state=0)
    asked = RideRequested("fleet/a", Target(2, "", 0), 100.5, -0.5)
    assert messages.accept_request(human, ANY, 100.0) == asked


def test_an_end_is_accepted_with_any_values_in_its_other_fields() -> None:
    bare = LiftRequest("Lift1", Time(100, 0), "fleet/a")
    odd = replace(bare, destination_floor="nowhere", door_state=77)
    ended = RideEnded("fleet/a", 100.0, 1.0)
    assert [messages.accept_request(m, ANY, 101.0) for m in (bare, odd)] == [ended, ended]


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"lift_name": ""}, "empty lift_name"),
        ({"session_id": ""}, "empty session_id"),
        ({"session_id": "", "request_type": 0}, "empty session_id"),
        ({"request_type": 3}, "unknown request_type"),
        ({"door_state": 1}, "unknown door_state"),
        ({"destination_floor": ""}, "no destination_floor"),
        ({"lift_name": "Lift2"}, "not ours"),
        ({"session_id": "x" * 257}, "impossible session_id"),
        ({"session_id": "x" * 257, "request_type": 0}, "impossible session_id"),
        ({"destination_floor": "x" * 257}, "impossible destination_floor"),
        ({"request_time": Time(-1, 0)}, "impossible request_time"),
        ({"request_time": Time(1, 10**9)}, "impossible request_time"),
    ],
)
def test_an_impossible_request_is_refused_with_the_name_of_its_field(
    changes: dict[str, object], kind: str
) -> None:
    wrong = replace(AGV, **changes)
    with pytest.raises(RequestRefused) as refusal:
        messages.accept_request(wrong, LiftSupervisorSettings(lifts=["Lift1"]), 101.0)
    assert refusal.value.kind == kind


def test_a_lift_state_is_read_field_by_field() -> None:
    state = LiftState(Time(), "Lift1", ("L1", "L3"), "L1", "L3", 1, 1, (1, 2), 2, "fleet/a")
    shown = LiftStateHeard("fleet/a", "L1", "L3", 1, 2, ("L1", "L3"))
    assert messages.accept_state(state, ANY, 0.0) == shown
    with pytest.raises(RequestRefused):
        messages.accept_state(state, LiftSupervisorSettings(lifts=["Lift2"]), 0.0)


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"lift_name": "x" * 257}, "impossible lift_name"),
        ({"session_id": "x" * 257}, "impossible session_id"),
        ({"current_floor": "x" * 257}, "impossible current_floor"),
        ({"destination_floor": "x" * 257}, "impossible destination_floor"),
        ({"available_floors": ("x" * 257,)}, "impossible available_floors"),
        ({"available_floors": ("x",) * 1001}, "impossible available_floors"),
    ],
)
def test_a_state_with_texts_that_are_too_long_is_dropped(
    changes: dict[str, object], kind: str
) -> None:
    state = replace(LiftState(lift_name="Lift1"), **changes)
    with pytest.raises(RequestRefused) as refusal:
        messages.accept_state(state, ANY, 0.0)
    assert refusal.value.kind == kind
    assert len(str(refusal.value)) < 400


def test_a_message_names_its_lift_and_gets_its_stamp_at_the_time_of_sending() -> None:
    assert messages.device_name(AGV) == "Lift1"
    assert messages.stamped(AGV, Time(7, 8)) == replace(AGV, request_time=Time(7, 8))


def test_the_summary_is_one_line_for_people() -> None:
    assert messages.summary(SupervisorReport(None), 50.0) == {
        "session": "-",
        "holder": "-",
        "waiting": "-",
    }
    waiting = (("fleet/b", 20.0), ("fleet/c", 45.4))
    busy = SupervisorReport(49.0, "fleet/a", "fleet/a", 10.0, True, waiting, (Fault("X"),))
    assert messages.summary(busy, 50.0) == {
        "session": "fleet/a",
        "ending": "fleet/a (40 s)",
        "waiting": "fleet/b (30 s), fleet/c (5 s)",
    }
