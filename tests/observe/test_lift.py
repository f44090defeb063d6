"""The memory of our observers about a lift: requesters, holder and waits. It also has the conditions
for which RMF's phase RequestLift still waits."""

import pytest

from bridges.observe.lift import ObservedLift, request_lift
from bridges.observe.limits import GIVEN_UP_S, MOST_REQUESTERS, REQUESTER_SILENT_S, SILENT_S
from bridges.observe.requesters import Moment
from tests.observe.story import AGV, BLUE, CLOSED, HUMAN, OPEN, RED, Story


def test_a_ride_from_its_request_to_its_end() -> None:
    story = Story().lift().passes(1)
    story.asks(RED).asks(RED, passed=True).passes(1).lift(RED).passes(1)
    story.lift(RED, "L2", OPEN).passes(1).ends(RED).ends(RED, passed=True).lift()
    assert story.told() == [
        "1 asks fleet/red AGV",
        "2 has fleet/red",
        "2 changed",
        "3 changed",
        "3 met fleet/red",
        "4 ends fleet/red",
        "4 passed on",
        "4 lost fleet/red",
        "4 over fleet/red",
        "4 changed",
    ]


@pytest.mark.parametrize(
    ("session", "floor", "door", "missing"),
    [
        (RED, "L2", "open", []),
        ("nobody", "L2", "open", ["session"]),
        (BLUE, "L1", "moving", ["session", "floor", "door"]),
    ],
)
def test_the_phase_request_lift_waits_only_for_session_and_floor_and_door(
    session: str, floor: str, door: str, missing: list[str]
) -> None:
    checks = request_lift(session, floor, door, RED, "L2")
    assert [check.name for check in checks if not check.met] == missing


def test_a_requester_waits_until_its_request_is_shown_and_again_afterwards() -> None:
    story = Story().lift().asks(RED)
    assert story.waits("lift", "Lift1") == [(RED, "L2", 0)]
    story.passes(2).asks(RED).lift(RED, "L2", OPEN)
    assert story.waits("lift", "Lift1") == []
    story.passes(2).asks(RED).lift(RED, "L2", CLOSED)
    assert story.waits("lift", "Lift1") == [(RED, "L2", 2)]
    story.passes(1).ends(RED)
    assert story.waits("lift", "Lift1") == []


def test_a_session_in_human_mode_waits_for_nothing_more() -> None:
    story = Story().lift().asks("dashboard", "L2", HUMAN).lift()
    assert story.waits("lift", "Lift1") == [("dashboard", "L2", 0)]
    assert story.lift("dashboard").waits("lift", "Lift1") == []
    assert story.asks("dashboard", "L2", AGV).waits("lift", "Lift1") == [("dashboard", "L2", 0)]


def test_a_requester_that_stops_asking_during_states_waits_no_longer() -> None:
    story = Story().lift().asks(RED)
    for _ in range(5):
        story.passes(1).lift()
    assert story.told() == ["0 asks fleet/red AGV", "4 gone fleet/red"]
    assert story.waits("lift", "Lift1") == []
    assert [*story.device("lift", "Lift1").requesters] == []


def test_without_states_nobody_repeats_a_request_and_all_keep_waiting() -> None:
    story = Story().lift().asks(RED).passes(100)
    assert story.waits("lift", "Lift1") == [(RED, "L2", 0)]
    story.asks(RED)
    assert story.waits("lift", "Lift1") == [(RED, "L2", 0)]


def test_a_request_that_pauses_before_the_first_state_begins_anew() -> None:
    story = Story().asks(RED).passes(GIVEN_UP_S).asks(RED)
    assert story.waits("lift", "Lift1") == [(RED, "L2", 0)]
    story.passes(GIVEN_UP_S + 1).asks(RED)
    assert story.waits("lift", "Lift1") == [(RED, "L2", 2 * GIVEN_UP_S + 1)]


def test_a_session_that_is_lost_without_an_end_is_over_and_its_robot_waits() -> None:
    story = Story().lift().passes(1).asks(RED).lift(RED).passes(1).asks(RED).lift(BLUE)
    assert story.told()[-4:] == [
        "2 lost fleet/red",
        "2 over fleet/red",
        "2 has fleet/blue",
        "2 changed",
    ]
    assert story.waits("lift", "Lift1") == [(RED, "L2", 1)]


@pytest.mark.parametrize("passed", [True, False])
def test_the_end_of_a_holder_without_a_heard_request_is_remembered(passed: bool) -> None:
    story = Story().lift(RED).passes(1).ends(RED, passed=passed)
    lift = story.device("lift", "Lift1")
    one = lift.requesters.get(RED)
    assert one is not None
    assert one.ended is not None
    assert (one.ended.at, one.end_passed_on, one.own) == (1, passed, not passed)


def test_an_end_before_the_first_state_is_remembered_until_the_state_shows_its_session() -> None:
    story = Story().ends(RED).passes(1).lift(RED)
    one = story.device("lift", "Lift1").requesters.get(RED)
    assert one is not None
    assert (one.ended is not None, one.own) == (True, True)


def test_a_robot_counts_as_ending_until_its_last_end_is_old() -> None:
    story = Story().lift(RED)
    for _ in range(5):
        story.passes(1).ends(RED).lift(RED)
    one = story.device("lift", "Lift1").requesters.get(RED)
    assert one is not None
    assert one.ends(story.graph.now)
    assert not one.ends(Moment(story.now + REQUESTER_SILENT_S + 0.1, 0.0))


def not_passed_on(story: Story) -> str:
    """Return the requester whose request the supervisor has not passed on to the lift, or ""."""
    lift = story.device("lift", "Lift1")
    assert isinstance(lift, ObservedLift)
    one = lift.not_passed_on(story.graph.now)
    return one.who if one else ""


@pytest.mark.parametrize("ends", [True, False])
def test_requests_of_the_holder_without_an_effect_are_not_passed_on(ends: bool) -> None:
    story = Story().lift(RED).asks(RED, passed=True)
    for _ in range(5):
        story.passes(1)
        (story.ends(RED) if ends else story.asks(RED)).lift(RED)
    assert not_passed_on(story) == RED
    assert not_passed_on(story.asks(RED, passed=True)) == ""


def test_requests_for_a_free_lift_are_passed_on_by_a_living_supervisor() -> None:
    story = Story()
    for _ in range(5):
        story.lift().asks(BLUE).passes(1)
    assert not_passed_on(story.lift()) == BLUE


def test_a_living_supervisor_drops_requests_of_other_robots_too() -> None:
    story = Story().lift(RED)
    for _ in range(9):
        story.passes(1).asks(BLUE).lift(RED)
    assert not_passed_on(story) == ""


def test_a_grant_without_a_request_of_the_supervisor_shows_an_unrecorded_topic() -> None:
    story = Story().lift().passes(1).asks(RED)
    for _ in range(9):
        story.lift(RED).passes(1).asks(RED)
    assert not_passed_on(story) == ""
    story.ends(RED).lift()
    for _ in range(9):
        story.lift().passes(1).asks(BLUE)
    assert not_passed_on(story) == ""
    assert not_passed_on(story.asks(RED, passed=True).passes(5).asks(BLUE).lift()) == BLUE


def test_only_an_abandoned_wish_is_remembered() -> None:
    story = Story().lift(RED).asks(RED, "L2").lift(RED, "L2", OPEN).asks(RED, "L3").lift(RED)
    one = story.device("lift", "Lift1").requesters.get(RED)
    assert one is not None
    assert (one.boarded_at, one.given_up) == ("L2", "")
    story.asks(RED, "L2")
    assert (one.boarded_at, one.given_up) == ("L2", "L3")


def test_the_last_request_of_the_supervisor_counts_and_adds_no_requester() -> None:
    story = Story().lift().asks(RED).asks(BLUE, passed=True).passes(1).asks(RED, passed=True)
    lift = story.device("lift", "Lift1")
    assert isinstance(lift, ObservedLift)
    assert lift.supervisor is not None
    assert (lift.supervisor.value, lift.supervisor.since.at) == (RED, 1)
    assert [(one.who, one.passed_on) for one in lift.requesters] == [(RED, lift.supervisor_last)]


def test_many_invented_names_are_bounded_and_displace_no_holder() -> None:
    story = Story().lift().asks(RED).lift(RED)
    for number in range(10 * MOST_REQUESTERS):
        story.asks(f"made/up{number}")
    names = [one.who for one in story.device("lift", "Lift1").requesters]
    assert len(names) == MOST_REQUESTERS
    assert names[0] == RED
    assert names[-1] == f"made/up{10 * MOST_REQUESTERS - 1}"


def test_the_next_state_ends_the_silence_of_a_lift() -> None:
    story = Story().lift().passes(SILENT_S)
    lift = story.device("lift", "Lift1")
    assert not lift.is_silent(story.graph.now)
    story.passes(0.5).asks(RED)
    assert lift.is_silent(story.graph.now)
    story.lift()
    assert story.told() == ["3.5 asks fleet/red AGV", "3.5 states again"]
    assert REQUESTER_SILENT_S > SILENT_S
