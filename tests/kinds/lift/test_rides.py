"""One robot's ride, from the request to the end of the session. Tests compare outputs and states."""

import pytest
from msgspec.structs import replace

from bridges.kinds.lift import messages
from bridges.kinds.lift.settings import Floor, LiftSettings
from bridges.kinds.lift.signals import DoorReading, LiftOutputs, LiftSample, Motion, Side
from bridges.kinds.shared.decision import RequestRefused
from bridges.messages.definitions import LiftMode, LiftMotion, LiftRequest, LiftState, Time
from bridges.messages.stamps import in_seconds
from tests.kinds.lift.story import (
    AGV,
    END,
    HUMAN,
    STANDING,
    WALL,
    Building,
    Controller,
    Story,
    boarding,
)

SUMMARY = ("mode", "floor", "door", "motion", "session", "boarded", "destination")
IDLE_AT_L1 = [(0.0, "OFFLINE, moving at ?"), (0.1, "HUMAN, closed at L1")]


def at(
    level: str | None, door: DoorReading = DoorReading.CLOSED, *, agv: bool = True
) -> LiftSample:
    """Return a reading of a standing car."""
    return LiftSample(level, door, motion=Motion.STOPPED, agv=agv)


# ---- LIFT-1, LIFT-2, LIFT-3, LIFT-DRIVE-2: a whole ride


def test_a_robot_rides_up_and_down_and_releases_the_lift() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    story.run(20.0)
    story.asks("A", "L1")
    story.run(40.0)
    story.ends("A")
    story.run(50.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.55, "call", "L3"),
        (5.6, "call", None),
        (5.9, "hold_door", "front"),
        (20.0, "hold_door", None),
        (20.3, "call", "L1"),
        (25.0, "call", None),
        (25.3, "hold_door", "front"),
        (42.7, "hold_door", None),
        (43.0, "agv_request", False),
    ]
    assert story.states == [
        *IDLE_AT_L1,
        (1.0, "HUMAN, closed at L1, A to L3"),
        (1.55, "AGV, closed at L1, A to L3"),
        (2.13, "AGV, closed at ?, A to L3"),
        (3.13, "AGV, closed at L2, A to L3"),
        (4.23, "AGV, closed at ?, A to L3"),
        (5.13, "AGV, closed at L3, A to L3"),
        (5.93, "AGV, moving at L3, A to L3"),
        (7.03, "AGV, open at L3, A to L3"),
        (20.0, "AGV, open at L3, A to L1"),
        (20.1, "AGV, moving at L3, A to L1"),
        (21.03, "AGV, closed at L3, A to L1"),
        (21.53, "AGV, closed at ?, A to L1"),
        (22.63, "AGV, closed at L2, A to L1"),
        (23.53, "AGV, closed at ?, A to L1"),
        (24.63, "AGV, closed at L1, A to L1"),
        (25.33, "AGV, moving at L1, A to L1"),
        (26.43, "AGV, open at L1, A to L1"),
        (40.0, "AGV, open at L1"),
        (42.73, "AGV, moving at L1"),
        (43.05, "HUMAN, moving at L1"),
        (43.73, "HUMAN, closed at L1"),
    ]
    assert story.motions == [
        LiftMotion.MOTION_UNKNOWN,
        LiftMotion.MOTION_STOPPED,
        LiftMotion.MOTION_UP,
        LiftMotion.MOTION_STOPPED,
        LiftMotion.MOTION_DOWN,
        LiftMotion.MOTION_STOPPED,
    ]
    assert story.faults == []


def test_a_lift_state_fills_every_field_that_rmf_asks_for() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("fleet/A", "L3")
    story.run(8.0)
    at_s, state = story.told[-1]
    assert in_seconds(state.lift_time) == pytest.approx(WALL + at_s)
    assert state == LiftState(
        lift_time=state.lift_time,
        lift_name="Lift1",
        available_floors=("L1", "L2", "L3", "L4"),
        current_floor="L3",
        destination_floor="L3",
        door_state=2,
        motion_state=0,
        available_modes=(1, 2),
        current_mode=2,
        session_id="fleet/A",
    )


def test_a_call_waits_until_the_status_input_confirms_agv_mode() -> None:
    story = Story()
    story.run(1.0)
    story.asks("A", "L2")
    story.run(5.0)
    story.building.set(agv=True)
    story.run(6.0)
    assert story.edges == [(1.0, "agv_request", True), (5.1, "call", "L2")]


def test_an_end_with_any_other_fields_is_obeyed_and_calls_no_car() -> None:
    for floor, door in (("", 0), ("L2", 2), ("attic", 7)):
        story = Story(Controller(), release_grace_s=0)
        story.run(1.0)
        story.asks("A", "L3")
        story.run(3.0)
        story.request(LiftRequest("Lift1", Time(), "A", int(END), floor, door))
        story.run(6.0)
        assert story.edges == [
            (1.0, "agv_request", True),
            (1.55, "call", "L3"),
            (3.0, "call", None),
            (3.0, "agv_request", False),
        ]
        assert story.states[5][1] == "AGV, closed at ?"
        assert story.states[5][0] - 3.0 <= 0.1


def test_an_end_of_a_free_lift_changes_nothing() -> None:
    story = Story()
    story.run(1.0)
    before = story.node.subject.memory
    story.ends("A")
    assert replace(story.node.subject.memory, senses=before.senses) == before
    assert story.edges == []


def test_a_repeated_request_switches_nothing() -> None:
    once, often = Story(Controller()), Story(Controller())
    for story in (once, often):
        story.run(1.0)
        story.asks("A", "L3")
        for _ in range(100):
            if story is often:
                story.asks("A", "L3")
            story.run(story.now + 0.1)
    assert often.edges == once.edges
    assert often.states == once.states


def test_a_request_for_an_unserved_floor_is_refused_and_the_session_goes_on() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    story.run(3.0)
    story.asks("A", "L7")
    story.asks("B", "")
    story.run(8.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.55, "call", "L3"),
        (5.6, "call", None),
        (5.9, "hold_door", "front"),
    ]
    assert story.state == "AGV, open at L3, A to L3"
    assert story.node.refused == {"floor not served": 2}


# ---- LIFT-1: HUMAN mode


def test_human_mode_requested_by_the_holder_gives_the_lift_to_the_public_and_keeps_the_session() -> (
    None
):
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    story.run(8.0)
    story.asks("A", "L3", HUMAN)
    story.run(12.0)
    assert story.outputs == LiftOutputs()
    assert story.edges[-2:] == [(8.0, "hold_door", None), (8.0, "agv_request", False)]
    assert story.state == "HUMAN, closed at L3, A to L3"
    story.asks("A", "L3", AGV)
    story.run(15.0)
    assert story.edges[-2:] == [(12.0, "agv_request", True), (12.55, "hold_door", "front")]
    assert story.state == "AGV, open at L3, A to L3"
    assert story.faults == []


def test_human_mode_requested_by_a_stranger_is_a_session_without_outputs() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("rmf-web", "L1", HUMAN)
    story.run(20.0)
    assert story.edges == []
    assert story.state == "HUMAN, closed at L1, rmf-web to L1"
    story.ends("rmf-web")
    story.asks("A", "L1")
    assert story.outputs == LiftOutputs(agv_request=True)


def test_human_mode_needs_no_floor() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L1")
    story.run(5.0)
    story.asks("A", "", HUMAN)
    story.run(6.0)
    assert (story.state, story.outputs) == ("HUMAN, moving at L1, A to ", LiftOutputs())
    assert story.node.status()["waits"] == "for END: in HUMAN mode people call the lift"
    story.ends("A")
    story.run(10.0)
    story.asks("rmf-web", "L9", HUMAN)
    story.run(11.0)
    assert (story.state, story.faults) == ("HUMAN, closed at L1, rmf-web to ", [])
    assert story.node.refused == {}


def test_the_grace_of_a_session_without_a_floor_has_no_outputs() -> None:
    story = boarding()
    story.asks("A", "", HUMAN)
    story.ends("A")
    story.run(10.0)
    assert (story.state, story.outputs) == ("AGV, open at L1", LiftOutputs())


def test_an_open_door_in_human_mode_is_not_offered_for_boarding() -> None:
    story = Story(Building(at("L1", DoorReading.OPEN, agv=False)))
    story.run(1.0)
    assert story.state == "HUMAN, open at L1"
    story.building.set(agv=True)
    story.asks("A", "L1", HUMAN)
    story.run(2.0)
    assert story.state == "AGV, moving at L1, A to L1"
    story = Story(Building(at("L1", DoorReading.OPEN, agv=False)))
    story.run(1.0)
    story.asks("A", "L1", HUMAN)
    story.run(3.0)
    assert story.state == "HUMAN, moving at L1, A to L1"


def test_a_floor_may_have_any_name_and_its_last_character_means_nothing() -> None:
    names = ["B1", "G", "L1", "L10", "8F_r"]
    story = Story(Controller(names), floors=names)
    story.run(1.0)
    for floor in ("L10", "B1", "8F_r", "G"):
        story.asks("A", floor)
        story.run(story.now + 30.0)
        assert story.state == f"AGV, open at {floor}, A to {floor}"
    calls = [value for _, name, value in story.edges if name == "call" and value]
    assert calls == ["L10", "B1", "8F_r", "G"]


# ---- LIFT-3, LIFT-DRIVE-3: a change of destination


def test_the_second_of_two_requests_in_one_scan_counts() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.request(
        LiftRequest("Lift1", Time(), "A", int(AGV), "L4", 2),
        LiftRequest("Lift1", Time(), "A", int(AGV), "L2", 2),
    )
    story.run(6.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.55, "call", "L2"),
        (3.6, "call", None),
        (3.9, "hold_door", "front"),
    ]


def test_relays_rest_between_two_calls_when_the_destination_changes_on_the_way() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L4")
    story.run(2.0)
    story.asks("A", "L2")
    story.run(3.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.55, "call", "L4"),
        (2.0, "call", None),
        (2.5, "call", "L2"),
    ]


def test_another_destination_first_releases_the_held_door_and_then_calls() -> None:
    story = Story(Building(at("L1", DoorReading.OPEN)))
    story.run(1.0)
    story.asks("A", "L1")
    story.run(3.0)
    story.asks("A", "L2")
    story.run(4.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.0, "hold_door", "front"),
        (3.0, "hold_door", None),
        (3.3, "call", "L2"),
    ]


# ---- LIFT-DRIVE-4: calls


def test_a_call_by_pulse_is_given_once_for_the_length_of_a_pulse() -> None:
    story = Story(Controller(), call_pulse_s=0.7)
    story.run(1.0)
    story.asks("A", "L3")
    story.run(8.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.55, "call", "L3"),
        (2.25, "call", None),
        (5.6, "hold_door", "front"),
    ]


@pytest.mark.parametrize("pulse_s", [None, 0.5])
def test_a_car_that_has_drifted_from_its_destination_is_called_again(pulse_s: float | None) -> None:
    story = Story(Building(at("L2")), call_pulse_s=pulse_s)
    story.run(1.0)
    story.asks("A", "L1")
    story.building.set(level="L1", motion=Motion.DOWN)
    story.run(1.2)
    story.building.set(motion=Motion.STOPPED)
    story.run(2.0)
    story.building.set(level=None, motion=Motion.UP)
    story.run(3.0)
    story.building.set(level="L2", motion=Motion.STOPPED)
    story.run(3.3)
    called = [(at_s, value) for at_s, name, value in story.edges if name == "call"]
    assert called == [(1.0, "L1"), (called[1][0], None), (3.13, "L1")]
    assert story.outputs == LiftOutputs(agv_request=True, call="L1")


# ---- LIFT-5, LIFT-SENSING-6: lifts with fewer lines


def test_without_an_agv_status_line_a_request_for_agv_mode_counts_as_agv_mode() -> None:
    story = Story(Building(replace(at("L1", DoorReading.OPEN), agv=None)))
    story.run(1.0)
    assert story.state == "HUMAN, open at L1"
    story.asks("A", "L1")
    story.run(2.0)
    assert story.edges == [(1.0, "agv_request", True), (1.0, "hold_door", "front")]
    assert story.state == "AGV, open at L1, A to L1"


def test_without_motion_lines_a_car_with_an_open_door_at_a_floor_counts_as_standing() -> None:
    building = Building(replace(at("L1", DoorReading.OPEN), motion=None))
    story = Story(building)
    story.run(1.0)
    building.set(door=DoorReading.CLOSED)
    story.run(2.0)
    assert story.motions == [
        LiftMotion.MOTION_UNKNOWN,
        LiftMotion.MOTION_STOPPED,
        LiftMotion.MOTION_UNKNOWN,
    ]


TWO_DOORS = {"L1": Floor(), "L2": Floor(), "L2_rear": Floor(level="L2", side=Side.REAR)}


def test_each_of_the_two_floor_names_of_a_landing_has_its_own_door() -> None:
    building = Building(replace(at("L2", agv=False), rear_door=DoorReading.CLOSED))
    story = Story(building, floors=TWO_DOORS)
    story.run(1.0)
    assert story.state == "HUMAN, closed at L2"
    building.set(agv=True)
    story.asks("A", "L2_rear")
    story.run(2.0)
    building.set(rear_door=DoorReading.OPEN)
    story.run(3.0)
    assert story.state == "AGV, open at L2_rear, A to L2_rear"
    story.asks("A", "L2")
    story.run(4.0)
    assert story.state == "AGV, closed at L2, A to L2"
    building.set(rear_door=DoorReading.CLOSED, door=DoorReading.OPEN)
    story.run(5.0)
    assert story.state == "AGV, open at L2, A to L2"
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.05, "hold_door", "rear"),
        (3.0, "hold_door", None),
        (3.5, "hold_door", "front"),
    ]


def test_a_door_without_wires_is_never_shown_open() -> None:
    story = Story(Building(at("L2", DoorReading.OPEN)), floors=TWO_DOORS)
    story.run(1.0)
    story.asks("A", "L2_rear")
    story.run(3.0)
    assert story.state == "AGV, moving at L2_rear, A to L2_rear"


def test_without_a_session_either_open_door_is_shown_at_its_floor() -> None:
    building = Building(replace(at("L2"), rear_door=DoorReading.OPEN))
    story = Story(building, floors=TWO_DOORS)
    story.run(1.0)
    assert story.state == "AGV, open at L2_rear"
    building.set(door=DoorReading.OPEN)
    story.run(1.5)
    assert story.state == "AGV, open at L2"
    building.set(door=DoorReading.CLOSED)
    building.set(rear_door=DoorReading.BETWEEN)
    story.run(2.0)
    assert story.state == "AGV, moving at L2"


# ---- refusals, and the texts for people


@pytest.mark.parametrize(
    ("request_", "kind"),
    [
        (LiftRequest("Lift1", Time(), "", 1, "L1", 2), "empty session_id"),
        (LiftRequest("Lift1", Time(), "", 2, "L1", 2), "empty session_id"),
        (LiftRequest("Lift1", Time(), "x" * 257, 1, "L1", 2), "impossible session_id"),
        (LiftRequest("Lift1", Time(), "A", 3, "L1", 2), "unknown request_type"),
        (LiftRequest("Lift1", Time(), "A", 1, "L1", 1), "unknown door_state"),
        (LiftRequest("Lift1", Time(), "A", 1, "", 2), "floor not served"),
    ],
)
def test_an_impossible_request_to_a_lift_is_refused_by_name(
    request_: LiftRequest, kind: str
) -> None:
    with pytest.raises(RequestRefused) as refused:
        messages.accept(request_, LiftSettings(floors=["L1"]))
    assert refused.value.kind == kind


def test_the_summary_tells_the_state_in_a_few_words() -> None:
    story = Story(Building(replace(STANDING, door=DoorReading.NOT_OPEN)), door_travel_s=2.0)
    status = story.node.status()
    assert {key: status[key] for key in SUMMARY} == {
        "mode": "OFFLINE",
        "floor": "?",
        "door": "moving",
        "motion": "unknown",
        "session": "-",
        "boarded": "no",
        "destination": "-",
    }
    story.run(3.0)
    story.asks("A", "L2")
    shown = {key: value for key, value in story.node.status().items() if key != "counts"}
    assert {**shown, "input_age_s": 0.0} == {
        "mode": LiftMode.MODE_HUMAN.name.removeprefix("MODE_"),
        "floor": "L1",
        "door": "closed (estimated)",
        "motion": "stopped",
        "session": "A",
        "boarded": "no",
        "destination": "L2",
        "waits": "for AGV mode",
        "outputs": "agv_request yes",
        "faults": [],
        "input_age_s": 0.0,
        "refused": {},
    }
