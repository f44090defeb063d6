"""The twelve defects of RMF's first lift node for dry contacts. That old node would fail each of these
tests.

The old node is sharp-rmf/low_level_lift 4425e25 (2020). We gave the defects the letters a to l. The
name of a test says what the old node did. The test checks that our node does not do it.
"""

import logging

import pytest

from bridges.kinds.lift import KIND, messages
from bridges.kinds.lift.settings import LiftSettings
from bridges.kinds.lift.signals import DoorReading, Hazard, LiftOutputs, LiftSample, Motion
from bridges.kinds.shared.decision import RequestRefused
from bridges.messages.definitions import LiftRequest, Time
from tests.kinds.lift.story import AGV, HUMAN, Building, Controller, Story

OPEN_AT_L1 = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)


def test_defect_a_a_request_for_another_lift_changed_session_and_destination() -> None:
    """In this project the daemon's inbox sorts messages by the lift's name. A node gets only its own
    messages."""
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    before = story.node.subject.memory
    for name in ("Lift2", "", "lift1"):
        request = LiftRequest(name, Time(), "B", int(AGV), "L1", 2)
        if KIND.device_name(request) == story.node.name:
            story.request(request)
    assert story.node.subject.memory == before


def test_defect_b_agv_mode_was_never_requested() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L3")
    assert story.edges == [(1.0, "agv_request", True)]


def test_defect_c_a_call_that_timed_out_stayed_on() -> None:
    story = Story(Building(OPEN_AT_L1), scan_s=0.5)
    story.run(1.0)
    while story.now < 131.0:
        story.asks("A", "L3")
        story.run(story.now + 5.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.0, "call", "L3"),
        (121.0, "call", None),
        (121.0, "agv_request", False),
        (131.0, "agv_request", True),
        (131.0, "call", "L3"),
    ]


def test_defect_d_a_request_blocked_the_node_until_the_car_came() -> None:
    """In this project the node accepts a request at once, and does not wait for the car. So a hazard
    right after the request counts in the next scan."""
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L4")
    assert story.now == 1.0
    story.run(3.0)
    story.building.hazard(Hazard.FIRE)
    story.run(3.1)
    assert story.outputs == LiftOutputs()


def test_defect_e_sessions_never_ended_and_strangers_released_the_lift() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    story.asks("A", "L1")
    story.ends("B")
    story.asks("B", "L1", HUMAN)
    story.run(2.0)
    assert story.state == "AGV, open at L1, A to L1"
    story.asks("A", "L1", HUMAN)
    story.run(3.0)
    assert story.state == "AGV, open at L1, A to L1"
    assert story.outputs == LiftOutputs()
    story.ends("A")
    story.run(4.0)
    assert story.state == "AGV, open at L1"


def test_defect_f_a_release_set_the_pins_up_again_and_moved_the_door() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    opened = story.building.opened
    story.ends("A")
    story.run(10.0)
    assert story.edges[2:] == [(4.7, "hold_door", None), (5.0, "agv_request", False)]
    assert story.building.opened == opened == 1


def test_defect_g_a_floor_was_the_last_character_of_its_name() -> None:
    floors = [f"L{n}" for n in range(1, 11)]
    story = Story(Controller(floors), floors=floors)
    story.run(1.0)
    story.asks("A", "L10")
    story.run(25.0)
    calls = [value for _, name, value in story.edges if name == "call"]
    assert calls == ["L10", None]
    assert story.state == "AGV, open at L10, A to L10"


@pytest.mark.parametrize(("level", "shown"), [(None, "?"), ("L2", "L2")])
def test_defect_h_a_missing_or_changing_code_read_as_a_wrong_floor(
    level: str | None, shown: str
) -> None:
    story = Story(Building(LiftSample(level, DoorReading.CLOSED, motion=Motion.UP, agv=True)))
    story.run(1.0)
    story.building.set(level="L3")  # the two bits of the floor code change one after the other
    story._scan()
    story.run(1.05)
    story.building.set(level=level)
    story.run(2.0)
    assert {state for _, state in story.states[1:]} == {f"AGV, closed at {shown}"}


def test_defect_i_alarms_were_not_filtered_never_cleared_and_stopped_nothing() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    story.building.hazard(Hazard.CODE_BLUE)
    story._scan()
    story.run(1.04)
    story.building.hazard()
    story.run(2.0)
    assert story.state == "AGV, open at L1"
    story.building.hazard(Hazard.CODE_BLUE)
    story.run(3.0)
    story.asks("A", "L3")
    assert (story.outputs, story.state) == (LiftOutputs(), "EMERGENCY, open at L1")
    story.building.hazard(Hazard.FIRE)
    story.run(6.0)
    story.asks("A", "L3")
    assert (story.outputs, story.state) == (LiftOutputs(), "FIRE, open at L1")
    story.building.hazard()
    story.run(9.0)
    assert story.state == "AGV, open at L1"


def test_defect_j_a_door_was_never_between_open_and_closed() -> None:
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    story.building.set(door=DoorReading.BETWEEN)
    story.run(2.0)
    assert story.state == "AGV, moving at L1"


def test_defect_k_a_lift_at_its_floor_accepted_any_floor() -> None:
    for floor in ("L1", "L0", "", "L11"):
        request = LiftRequest("Lift1", Time(), "A", int(AGV), floor, 2)
        if floor == "L1":
            messages.accept(request, LiftSettings(floors=["L1", "L2"]))
            continue
        with pytest.raises(RequestRefused):
            messages.accept(request, LiftSettings(floors=["L1", "L2"]))


def test_defect_l_the_log_had_a_line_each_second(caplog: pytest.LogCaptureFixture) -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L1")
    story.run(5.0)
    caplog.clear()
    with caplog.at_level(logging.DEBUG):
        for _ in range(60):
            story.asks("A", "L1")
            story.asks("B", "L1")
            story.run(story.now + 1.0)
    lines = [r.getMessage() for r in caplog.records]
    assert lines == [
        'refused device=Lift1 kind="held by another session"'
        ' detail="A; session_id B, agv yes, destination L1, stamp 0"'
    ]
