"""The session of a lift: how it is granted, repeated and refused, and how END and the grace after END
end it."""

from typing import Any

import pytest

from bridges.kinds.lift import KIND
from bridges.kinds.lift.core import decide
from bridges.kinds.lift.signals import (
    DoorReading,
    EndRequested,
    Hazard,
    LiftOutputs,
    LiftRequested,
    LiftSample,
    Motion,
    Side,
)
from bridges.kinds.shared.decision import (
    IoFailed,
    OperatorReset,
    RivalSeen,
    WriteFailed,
)
from bridges.messages.definitions import LiftRequest, LiftState
from tests.kinds.lift.alone import ASKED, AT_L1, Alone
from tests.kinds.lift.story import AGV, HUMAN, Building, Controller, Story
from tests.kinds.lift.test_forgotten import Overheard
from tests.kinds.lift.test_with_rmf import A

OPEN_AT_L1 = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)


def boarded() -> Story:
    """Return a story in which robot A may be in the car, because the lift has shown OPEN for about 3
    s."""
    story = Story(Building(OPEN_AT_L1))
    story.run(1.0)
    story.asks("A", "L1")
    story.run(4.0)
    assert story.state == "AGV, open at L1, A to L1"
    return story


# ---- LIFT-1: one session at a time


def test_requests_of_other_robots_change_nothing_during_a_session() -> None:
    alone, beset = boarded(), boarded()
    for story in (alone, beset):
        for second in range(5, 15):
            story.asks("A", "L1")
            if story is beset:
                story.asks("B", "L3")
                story.asks("B", "L3", HUMAN)
                story.ends("B")
                story.ends("")
            story.run(float(second))
    assert beset.edges == alone.edges
    assert beset.states == alone.states
    assert beset.node.refused == {"held by another session": 30}


def test_a_message_names_the_lift_that_it_is_for() -> None:
    assert KIND.device_name(LiftRequest(lift_name="Lift2", session_id="A")) == "Lift2"
    assert KIND.device_name(LiftState(lift_name="Lift3")) == "Lift3"


@pytest.mark.parametrize(
    "event", [EndRequested("A"), IoFailed("timeout"), OperatorReset(), RivalSeen()]
)
def test_only_a_request_can_be_refused(event: Any) -> None:
    assert Alone()(0.0, AT_L1, event).decision.refused == ""


# ---- LIFT-2: END and the grace after it


def test_an_end_frees_the_lift_and_the_outputs_go_off_after_the_grace() -> None:
    story = boarded()
    story.ends("A")
    story.run(10.0)
    assert story.edges == [
        (1.0, "agv_request", True),
        (1.0, "hold_door", "front"),
        (6.7, "hold_door", None),
        (7.0, "agv_request", False),
    ]
    assert story.states[-2:] == [(1.0, "AGV, open at L1, A to L1"), (4.1, "AGV, open at L1")]


def test_a_session_that_returns_within_the_grace_finds_everything_unchanged() -> None:
    story = boarded()
    edges = list(story.edges)
    for _ in range(5):
        story.ends("A")
        story.run(story.now + 2.6)
        story.asks("A", "L1")
        story.run(story.now + 2.0)
    assert story.edges == edges
    assert story.state == "AGV, open at L1, A to L1"


def test_a_session_that_returns_for_another_floor_keeps_its_door_while_that_floor_is_in_doubt() -> (
    None
):
    lift = Overheard()
    lift.adapter(AGV, "L2")
    lift.story.run(lift.story.now + 6.0)
    edges = list(lift.story.edges)
    lift.story.ends(A)
    assert lift.story.state == "AGV, open at L2"
    lift.story.asks(A, "L4")
    lift.story.run(lift.story.now + 2.0)
    assert lift.story.state == "AGV, open at L2, fleet/a to L2"
    assert lift.story.edges == edges


def test_a_request_in_doubt_shows_too_that_rmf_is_alive() -> None:
    lift = Overheard()
    lift.adapter(AGV, "L2")
    lift.story.asks(A, "L2")
    lift.story.run(lift.story.now + 29.0)
    lift.story.asks(A, "L4")
    lift.story.run(lift.story.now + 2.0)
    assert (lift.story.state, lift.story.faults) == ("AGV, open at L2, fleet/a to L2", [])


def test_an_event_without_effect_is_not_refused() -> None:
    alone = Alone(release_grace_s=2.0)(0.0, AT_L1)(0.1, WriteFailed("timeout"))
    assert alone.decision.refused == ""
    alone(0.2, AT_L1, ASKED)(1.0, AT_L1, EndRequested("A"))(1.5, ASKED)
    assert (alone.decision.refused, alone.decision.report.session) == ("", "A")


def test_no_other_session_is_granted_within_the_grace() -> None:
    story = boarded()
    story.ends("A")
    story.run(6.9)
    story.asks("B", "L2")
    assert story.node.refused == {"released a moment ago": 1}
    assert story.state == "AGV, open at L1"
    story.run(7.0)
    story.asks("B", "L2")
    story.run(8.0)
    assert story.state == "AGV, open at L1, B to L2"
    assert story.edges[-3:] == [
        (7.0, "agv_request", False),
        (7.5, "agv_request", True),
        (7.5, "call", "L2"),
    ]


def test_any_session_may_begin_at_the_end_of_the_grace() -> None:
    alone = Alone(release_grace_s=2.0)(0.0, AT_L1)(0.1, ASKED)(1.0, EndRequested("A"))
    alone(2.9, AT_L1)
    alone(3.0, LiftRequested("B", True, "L1"))
    assert alone.decision.refused == ""
    assert alone.decision.report.session == "B"


def test_the_grace_ends_on_time_even_for_a_request_before_the_scan() -> None:
    story = boarded()
    story.ends("A")
    story.run(6.9)
    memory, rules = story.node.subject.memory, story.limits
    assert decide(memory, LiftRequested("B", True, "L2"), 6.99, rules).refused
    granted = decide(memory, LiftRequested("B", True, "L2"), 7.0, rules)
    assert (granted.report.session, granted.memory.grace) == ("B", None)


def test_even_a_short_grace_lasts_its_time() -> None:
    alone = Alone(release_grace_s=0.5)(0.0, AT_L1)(0.1, ASKED)(1.0, AT_L1, EndRequested("A"))
    assert alone.decision.outputs == LiftOutputs(agv_request=True, hold_door=Side.FRONT)
    assert alone(1.5, AT_L1).decision.outputs == LiftOutputs()


def test_a_second_end_does_not_prolong_the_grace() -> None:
    story = boarded()
    story.ends("A")
    story.run(6.0)
    story.ends("A")
    story.run(10.0)
    assert story.edges[-1] == (7.0, "agv_request", False)


def test_no_output_is_switched_on_during_the_grace() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L1")
    story.run(1.3)
    story.ends("A")  # END comes before the lift grants AGV mode
    story.run(10.0)
    assert story.edges == [(1.0, "agv_request", True), (4.3, "agv_request", False)]


# ---- LIFT-DRIVE-1: no outputs without a session


def test_a_call_is_never_energised_without_a_session() -> None:
    story = Story(Controller())
    story.run(1.0)
    story.asks("A", "L4")
    story.run(3.0)
    story.ends("A")
    story.run(4.0)
    assert story.outputs == LiftOutputs(agv_request=True)
    story.asks("A", "L4")
    story.run(5.0)
    assert story.edges[2:] == [(3.0, "call", None), (4.0, "call", "L4")]


# ---- LIFT-2, LIFT-DRIVE-1: what may stay on in the grace


def test_a_pulse_that_an_end_cut_short_is_repeated_for_the_same_session() -> None:
    story = Story(Controller(), call_pulse_s=1.0)
    story.run(1.0)
    story.asks("A", "L4")
    story.run(2.0)
    story.ends("A")
    story.run(4.0)
    story.asks("A", "L4")
    story.run(6.0)
    calls = [edge for edge in story.edges if edge[1] == "call"]
    assert calls == [(1.55, "call", "L4"), (2.0, "call", None), (4.0, "call", "L4"),
                     (5.0, "call", None)]  # fmt: skip


def test_a_hazard_in_the_grace_switches_outputs_off_but_a_robot_inside_gets_its_session_back() -> (
    None
):
    story = boarded()
    story.ends("A")
    story.run(4.5)
    story.building.hazard(Hazard.FIRE)
    story.run(5.0)
    assert story.outputs == LiftOutputs()
    story.asks("B", "L2")
    assert story.state == "FIRE, open at L1"
    story.asks("A", "L1")
    story.run(6.0)
    assert story.state == "FIRE, open at L1, A to L1"
    assert story.outputs == LiftOutputs()


def test_no_output_is_held_after_a_hazard_has_ended_the_grace() -> None:
    story = boarded()
    story.ends("A")
    story.building.hazard(Hazard.CODE_BLUE)
    story.run(4.5)
    story.building.hazard()
    story.run(6.5)
    assert story.edges[-2:] == [(4.1, "hold_door", None), (4.1, "agv_request", False)]


def test_agv_mode_that_is_lost_in_the_grace_releases_the_door() -> None:
    story = boarded()
    story.ends("A")
    story.building.set(agv=False)
    story.run(10.0)
    assert story.edges[2:] == [(4.1, "hold_door", None), (7.0, "agv_request", False)]


def test_the_door_of_a_car_that_moves_in_the_grace_is_not_held() -> None:
    story = boarded()
    story.ends("A")
    story.building.set(motion=Motion.UP)
    story.run(6.0)
    assert story.edges[2:] == [(4.1, "hold_door", None)]


def test_agv_mode_that_ends_while_the_relay_rests_belongs_to_the_last_session() -> None:
    story = Story(Building(OPEN_AT_L1), release_grace_s=0)
    story.run(1.0)
    story.asks("A", "L1")
    story.run(2.0)
    story.ends("A")
    story.asks("B", "L1")
    story.run(2.1)
    story.building.set(agv=False)
    story.run(3.0)
    assert (story.faults, story.outputs) == ([], LiftOutputs(agv_request=True))


def test_a_session_that_never_had_agv_mode_leaves_no_grace() -> None:
    story = Story()
    story.run(1.0)
    story.asks("A", "L2", HUMAN)
    story.run(2.0)
    story.ends("A")
    story.asks("B", "L2")
    story.run(3.0)
    assert story.state == "HUMAN, closed at L1, B to L2"


# ---- LIFT-1, LIFT-4: when no session gets the lift


@pytest.mark.parametrize(
    ("hazard", "why"),
    [
        (Hazard.FIRE, "FIRE"),
        (Hazard.CODE_BLUE, "CODE_BLUE"),
        (Hazard.EARTHQUAKE, "EARTHQUAKE"),
        (Hazard.EMERGENCY, "EMERGENCY"),
        (Hazard.OUT_OF_SERVICE, "OUT_OF_SERVICE"),
        (Hazard.MANUAL, "MANUAL"),
    ],
)
def test_no_session_is_granted_during_a_hazard(hazard: Hazard, why: str) -> None:
    story = Story()
    story.building.hazard(hazard)
    story.run(1.0)
    story.asks("A", "L2")
    assert story.node.refused == {why: 1}
    assert story.told[-1][1].session_id == ""


def test_before_the_inputs_have_settled_no_session_is_granted() -> None:
    story = Story()
    story.asks("A", "L2")
    assert story.node.refused == {"inputs settle after the start": 1}
    story.run(0.2)
    story.asks("A", "L2")
    assert story.outputs == LiftOutputs(agv_request=True)
