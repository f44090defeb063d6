"""The lift supervisor's rules, each tested alone. Tests compare all messages to the lift's node."""

import math

import pytest

from bridges.kinds.lift_supervisor import core
from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits, SupervisedLift
from bridges.kinds.lift_supervisor.signals import LiftStateHeard
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import FORGOTTEN_S, REPEAT_S, SILENT_S
from bridges.kinds.shared.freshness import MAX_REQUESTERS
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.messages.definitions import LiftRequest
from tests.kinds.lift_supervisor.alone import Alone

# ---- LIFT-SUPERVISOR-3, LIFT-SUPERVISOR-7: one robot


def test_without_a_state_a_first_request_is_sent_at_once_and_only_once() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(9.0)
    assert desk.sent == [(0.0, "AGV a L3")]


def test_a_request_goes_to_the_node_with_every_field_that_the_adapter_filled_in() -> None:
    desk = Alone()
    desk.asks("a")
    assert core.wanted(desk.memory) == LiftRequest(
        lift_name="Lift1", session_id="a", request_type=1, destination_floor="L3", door_state=2
    )


def test_states_without_the_request_cause_repeats_at_most_once_a_second() -> None:
    desk = Alone()
    desk.asks("a")
    for tenth in range(1, 31):
        desk.until(tenth / 10)
        desk.shows("a", "L1", to="L3")
    assert desk.sent == [(t, "AGV a L3") for t in (0.0, 1.0, 2.0, 3.0)]


@pytest.mark.parametrize(
    "mismatch",
    [
        LiftStateHeard("", "L3", "", 2, 2),
        LiftStateHeard("a", "L1", "", 2, 2),
        LiftStateHeard("a", "L3", "L1", 2, 2),
        LiftStateHeard("a", "L1", "L3", 0, 2),
        LiftStateHeard("a", "L1", "L3", 1, 2),
    ],
)
def test_any_difference_between_request_and_state_causes_a_repeat(mismatch: LiftStateHeard) -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.hears(mismatch)
    assert desk.sent == [(0.0, "AGV a L3"), (1.0, "AGV a L3")]


@pytest.mark.parametrize(
    "match", [LiftStateHeard("a", "L3", "", 2, 2), LiftStateHeard("a", "L1", "L3", 2, 2)]
)
def test_a_state_that_shows_the_request_causes_no_repeat(match: LiftStateHeard) -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.hears(match)
    desk.until(5.0)
    assert desk.sent == [(0.0, "AGV a L3")]


def test_repeats_of_the_holder_are_passed_on_once_a_second_as_a_sign_of_life() -> None:
    desk = Alone()
    for tenth in range(25):
        desk.until(tenth / 10)
        desk.ride("a")
        desk.asks("a")
    assert desk.sent == [(0.0, "AGV a L3"), (1.0, "AGV a L3"), (2.0, "AGV a L3")]


def test_a_request_of_an_earlier_turn_is_repeated_after_exactly_a_second() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(0.3)
    desk.hears(MaySpeak(False))
    desk.hears(MaySpeak(True))
    desk.until(3.0)
    assert desk.sent == [(0.0, "AGV a L3"), (REPEAT_S, "AGV a L3")]


def test_another_destination_is_sent_at_once_but_at_most_ten_times_a_second() -> None:
    desk = Alone()
    for number in range(9):
        desk.until(number * 0.03)
        desk.asks("a", f"L{number}")
    desk.until(1.0)
    assert desk.sent == [
        (0.0, "AGV a L0"),
        (0.1, "AGV a L3"),
        (0.2, "AGV a L6"),
        (0.3, "AGV a L8"),
    ]


def test_a_human_mode_request_is_passed_on_unchanged() -> None:
    desk = Alone()
    desk.asks("web", "L1", kind=2)
    assert desk.sent == [(0.0, "HUMAN web L1")]


def test_a_request_for_an_unserved_floor_blocks_nobody_else() -> None:
    desk = Alone()
    desk.shows("", floors=("L1", "L3"))
    desk.asks("a", "L2")
    desk.asks("b", "L3")
    assert desk.sent == [(0.0, "AGV b L3")]
    assert desk.refused == [(0.0, "floor not served")]


def test_human_mode_needs_no_served_floor() -> None:
    desk = Alone()
    desk.shows("", floors=("L1", "L3"))
    desk.asks("web", "", kind=2)
    assert desk.sent == [(0.0, "HUMAN web")]


def test_a_request_for_an_unserved_floor_is_a_sign_of_life_and_changes_nothing() -> None:
    desk = Alone(LiftSupervisorLimits(holder_alarm_s=20.0))
    desk.asks("a")
    for second in range(1, 30):
        desk.until(float(second))
        desk.shows("a", "L3", to="L3", open=True, floors=("L1", "L3"))
        desk.asks("a", "L9")
    assert desk.sent == [(0.0, "AGV a L3")]
    assert desk.faults == []


def test_a_claim_for_a_floor_that_is_not_served_blocks_nobody() -> None:
    desk = Alone()
    desk.asks("a", "L9")
    for second in range(1, 5):
        desk.until(float(second))
        desk.shows(floors=("L1", "L3"))
        desk.asks("a", "L9")
        desk.asks("b", "L3")
    assert [message for _, message in desk.sent] == [
        "AGV a L9", "AGV a L9", "END a L1", "AGV b L3", "AGV b L3", "AGV b L3"]  # fmt: skip
    assert desk.waiting == []


def test_the_end_of_a_claim_for_a_floor_that_is_not_served_is_no_persons() -> None:
    desk = Alone()
    desk.asks("a", "L9")
    desk.shows(floors=("L1", "L3"))
    desk.until(1.0)
    desk.asks("a", "L9")
    end = core.wanted(desk.memory)
    assert end is not None
    assert (end.request_type, end.door_state) == (core.END, 0)


@pytest.mark.parametrize(("floor", "waiting"), [("L1", ["a"]), ("L9", [])])
def test_after_a_request_for_an_unserved_floor_only_a_claim_for_a_served_one_stays_in_the_queue(
    floor: str, waiting: list[str]
) -> None:
    desk = Alone()
    desk.asks("b")
    desk.asks("a", floor)
    desk.shows("b", "L3", to="L3", open=True, floors=("L1", "L3"))
    desk.until(1.0)
    desk.asks("a", "L9")
    assert (desk.waiting, desk.sent) == (waiting, [(0.0, "AGV b L3")])


def test_a_session_in_the_lift_stays_when_its_floor_is_no_longer_served() -> None:
    desk = Alone()
    desk.asks("a", "L9")
    for second in range(1, 30):
        desk.until(float(second))
        desk.shows("a", "L1", to="L9", floors=("L1", "L3"))
        desk.asks("a", "L9")
    assert not any("END" in message for _, message in desk.sent)


# ---- LIFT-SUPERVISOR-4: END


def test_the_end_of_the_holder_is_sent_at_once_with_the_floor_of_the_car() -> None:
    desk = Alone()
    desk.asks("a")
    desk.shows("a", "L2", to="L3")
    desk.until(0.5)
    desk.ends("a")
    assert desk.sent == [(0.0, "AGV a L3"), (0.5, "END a L2")]


def test_no_end_that_counts_is_refused() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.ends("a")
    assert (desk.sent[-1], desk.refused) == ((1.0, "END a"), [])


def test_an_end_is_repeated_at_most_once_a_second_for_states_with_the_session() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ride("a")
    desk.until(1.0)
    desk.ends("a")
    desk.until(10.0)
    for half in range(20, 29):
        desk.until(half / 2)
        desk.ride("a")
    desk.shows("", "L3")
    desk.until(60.0)
    ends = [(t, "END a L3") for t in (1.0, 10.0, 11.0, 12.0, 13.0, 14.0)]
    assert desk.sent == [(0.0, "AGV a L3"), *ends]


def test_the_next_robot_is_served_only_after_a_state_shows_that_the_end_was_obeyed() -> None:
    desk = Alone()
    desk.asks("a")
    desk.asks("b", "L1")
    desk.shows("", "L2")  # a state from before the lift heard A's request
    desk.ends("a")
    desk.until(0.1)
    for second in range(1, 4):
        desk.until(float(second))
        desk.asks("b", "L1")
        desk.ride("a")
    desk.until(3.5)
    desk.shows("", "L3")
    assert desk.sent == [
        (0.0, "AGV a L3"),
        (0.1, "END a L2"),
        (1.1, "END a L3"),
        (2.1, "END a L3"),
        (3.1, "END a L3"),
        (3.5, "AGV b L1"),
    ]


def test_a_state_from_before_the_end_was_sent_confirms_nothing() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(0.05)
    desk.ends("a")  # the pacing delays this END until 0.1 s
    desk.shows("", "L1")
    desk.asks("b")
    assert desk.report.holder == "a"
    desk.until(0.3)
    desk.shows("", "L1")
    assert desk.sent == [(0.0, "AGV a L3"), (0.1, "END a L1"), (0.3, "AGV b L3")]


def test_another_session_in_the_state_of_the_lift_also_confirms_the_end() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ends("a")
    desk.until(0.2)
    desk.shows("b", "L1")
    assert desk.report.holder == ""


def test_an_end_of_a_robot_without_session_and_request_is_ignored() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ends("b")
    desk.until(5.0)
    assert desk.sent == [(0.0, "AGV a L3")]


def test_an_end_of_the_shown_session_is_passed_on_even_if_another_robot_waits() -> None:
    """Before, the lift granted the session to robot A without this supervisor. Now A or an operator
    sends END."""
    desk = Alone()
    desk.asks("b")
    desk.shows("a", "L2")
    desk.until(0.5)
    desk.ends("a")
    desk.until(0.7)
    desk.shows("", "L2")
    assert desk.sent == [(0.0, "AGV b L3"), (0.5, "END a L2"), (0.7, "AGV b L3")]


def test_an_end_during_the_end_of_another_session_takes_effect_at_its_repeat() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ends("a")
    desk.until(0.1)
    desk.ends("b")
    assert desk.report.holder == "a"


def test_a_robot_that_asks_again_after_its_end_is_served_again_in_its_turn() -> None:
    desk = Alone()
    desk.asks("a")
    desk.asks("b", "L1")
    desk.until(0.5)
    desk.ends("a")
    desk.until(0.6)
    desk.asks("a", "L2")
    desk.shows("", "L3")
    assert desk.waiting == ["a"]
    desk.until(1.0)
    desk.ends("b")
    desk.until(1.1)
    desk.shows("", "L3")
    assert [text for _, text in desk.sent] == [
        "AGV a L3",
        "END a",
        "AGV b L1",
        "END b L3",
        "AGV a L2",
    ]


# ---- LIFT-SUPERVISOR-1: the queue


def test_robots_are_served_in_the_order_of_their_first_requests() -> None:
    desk = Alone()
    for who in "abc":
        desk.asks(who, f"to-{who}")
    desk.until(0.5)
    for who in "cba":
        desk.asks(who, f"to-{who}")
    assert desk.waiting == ["b", "c"]
    for who in "abc":
        desk.shows(who)
        desk.until(desk.now + 0.5)
        desk.ends(who)
        desk.until(desk.now + 0.5)
        desk.shows("")
    order = [text for _, text in desk.sent if text.startswith("AGV")]
    assert list(dict.fromkeys(order)) == ["AGV a to-a", "AGV b to-b", "AGV c to-c"]


def test_a_place_in_the_queue_dates_from_the_first_request() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.asks("b")
    desk.until(2.0)
    desk.asks("b")
    assert desk.report.waiting == (("b", 1.0),)


def test_a_robot_that_is_silent_for_10_s_leaves_the_queue_and_returns_at_its_end() -> None:
    desk = Alone()
    desk.shows("")
    for who in "abc":
        desk.asks(who)
    for second in range(1, 11):
        desk.until(float(second))
        desk.shows("a", "L1", to="L3")
        desk.asks("a")
        desk.asks("c")
        assert desk.waiting == (["b", "c"] if second < 10 else ["c"])
    desk.asks("b")
    assert desk.waiting == ["c", "b"]


def test_requesters_may_be_silent_while_the_lift_is_silent() -> None:
    """Fleet adapters repeat a request only when a state of the lift arrives."""
    desk = Alone(LiftSupervisorLimits(holder_ttl_s=70.0))
    desk.asks("a")
    desk.asks("b")
    desk.ride("a")
    desk.until(1000.0)
    assert (desk.report.holder, desk.waiting, desk.faults) == ("a", ["b"], ["LIFT_SILENT"])
    desk.ride("a")
    assert (desk.report.holder, desk.waiting, desk.faults) == ("a", ["b"], [])
    for second in range(1, 10):
        desk.until(1000.0 + second)
        desk.ride("a")
    assert desk.waiting == ["b"]
    desk.until(1010.0)
    assert desk.waiting == []


def test_a_silent_lift_is_a_fault_only_if_a_robot_waits() -> None:
    desk = Alone()
    desk.shows("", mode="FIRE")
    desk.until(10.0)
    assert desk.faults == []
    desk.asks("a")
    assert (desk.waiting, desk.faults) == (["a"], ["LIFT_SILENT"])


def test_the_core_wakes_when_the_lift_counts_as_silent_and_says_so() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ride()
    late = math.nextafter(SILENT_S, math.inf)
    assert desk.wake_at == late
    desk.until(late)
    assert desk.report.faults == (Fault("LIFT_SILENT", "no LiftState comes"),)


def test_a_lift_is_silent_exactly_three_seconds_after_its_last_state() -> None:
    state = LiftStateHeard("", "L1", "", 0, 2)
    memory = SupervisedLift("Lift1", 0.0, shown=state, shown_at=10.0)
    assert [memory.flows(now) for now in (13.0, 13.1)] == [True, False]


def test_a_holder_of_a_lift_that_was_never_heard_is_ended() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(100.0)
    assert desk.sent == [(0.0, "AGV a L3"), (10.0, "END a")]
    assert not core.idle(desk.memory, 59.0)
    assert core.idle(desk.memory, 60.0)


def test_a_silent_lift_is_forgotten_if_nobody_wants_it() -> None:
    desk = Alone()
    desk.shows("")
    assert not core.idle(desk.memory, 59.0)
    assert core.idle(desk.memory, 60.0)
    desk.asks("a")
    desk.shows("a")
    desk.until(1000.0)
    assert not core.idle(desk.memory, 1000.0)


def test_a_silent_lift_that_shows_a_session_is_not_forgotten_while_robots_want_it() -> None:
    shown = Alone()
    shown.shows("a")
    shown.asks("b")
    assert not core.idle(shown.memory, 1000 * FORGOTTEN_S)
    taken = Alone()
    taken.asks("a")
    taken.shows("a")
    taken.shows("")
    assert not core.idle(taken.memory, 1000 * FORGOTTEN_S)


def test_a_robot_that_only_waits_for_a_silent_lift_is_forgotten_after_ten_minutes() -> None:
    desk = Alone()
    desk.asks("a")
    assert not core.idle(desk.memory, math.nextafter(10 * FORGOTTEN_S, 0.0))
    assert core.idle(desk.memory, 10 * FORGOTTEN_S)


def test_a_waiting_robot_leaves_the_queue_with_its_end() -> None:
    desk = Alone()
    desk.asks("a")
    desk.asks("b")
    desk.until(1.0)
    desk.ends("b")
    assert desk.waiting == []
    assert desk.sent == [(0.0, "AGV a L3")]


def test_a_queue_has_a_maximum_length() -> None:
    desk = Alone()
    for number in range(core.MAX_CLAIMS + 1):
        desk.asks(f"robot {number}")
    assert len(desk.waiting) == core.MAX_CLAIMS - 1
    assert desk.refused == [(0.0, "queue full")]


def test_beyond_the_bound_the_oldest_requesters_are_forgotten_first() -> None:
    desk = Alone()
    for number in range(MAX_REQUESTERS + 1):
        desk.ends(f"robot {number}")
    assert len(desk.memory.requesters) == MAX_REQUESTERS
    assert "robot 0" not in desk.memory.requesters


def test_many_invented_names_do_not_displace_a_waiting_robot() -> None:
    desk = Alone()
    desk.asks("a")
    desk.asks("b")
    for number in range(MAX_REQUESTERS):
        desk.ends(f"invented {number}")
    assert {"a", "b"} < set(desk.memory.requesters)
