"""The supervisor's core at its edges: what a mutation run found untested (docs/mutation.md)."""

import math

from bridges.kinds.lift_supervisor import core
from bridges.kinds.lift_supervisor.memory import Limits, Memory
from bridges.kinds.lift_supervisor.settings import Settings
from bridges.kinds.lift_supervisor.signals import StateHeard
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import FORGOTTEN_S, NEVER, REPEAT_S, SILENT_S
from bridges.kinds.shared.freshness import FUTURE_S, MAX_REQUESTERS, Rules
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.messages.definitions import LiftRequest
from tests.kinds.lift_supervisor.alone import Alone


def test_a_request_goes_to_the_node_with_every_field_that_the_adapter_filled_in() -> None:
    desk = Alone()
    desk.asks("a")
    assert core.wanted(desk.memory) == LiftRequest(
        lift_name="Lift1", session_id="a", request_type=1, destination_floor="L3", door_state=2
    )


def test_a_request_that_was_sent_in_an_earlier_turn_is_repeated_a_second_later_and_no_sooner() -> (
    None
):
    desk = Alone()
    desk.asks("a")
    desk.until(0.3)
    desk.hears(MaySpeak(False))
    desk.hears(MaySpeak(True))
    desk.until(3.0)
    assert desk.sent == [(0.0, "AGV a L3"), (REPEAT_S, "AGV a L3")]


def test_an_end_that_counts_is_not_refused() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.ends("a")
    assert (desk.sent[-1], desk.refused) == ((1.0, "END a"), [])


def test_a_robot_that_waits_is_known_however_many_names_are_heard_after_it() -> None:
    desk = Alone()
    desk.asks("a")
    desk.asks("b")
    for number in range(MAX_REQUESTERS):
        desk.ends(f"invented {number}")
    assert {"a", "b"} < set(desk.memory.requesters)


def test_a_place_in_the_queue_dates_from_the_first_request() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.asks("b")
    desk.until(2.0)
    desk.asks("b")
    assert desk.report.waiting == (("b", 1.0),)


def test_a_silent_holder_whose_turn_is_ended_does_not_wait_in_the_queue() -> None:
    desk = Alone(Limits(holder_ttl_s=5.0, holder_alarm_s=2.0))
    desk.asks("a")
    for second in range(6):
        desk.until(float(second))
        desk.shows("a", "L1", to="L3")
    assert (desk.report.holder, desk.report.ending, desk.waiting) == ("a", True, [])


def test_a_state_in_the_last_instant_before_the_lift_counts_as_silent_continues_those_before() -> (
    None
):
    def session_since(seconds: float) -> float:
        desk = Alone()
        desk.shows("a", "L2")
        desk.until(seconds)
        desk.shows("a", "L2")
        return desk.memory.session_since

    late = math.nextafter(SILENT_S, math.inf)
    assert (session_since(SILENT_S), session_since(late)) == (0.0, late)


def test_the_core_wakes_when_the_lift_counts_as_silent_and_says_so() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ride()
    late = math.nextafter(SILENT_S, math.inf)
    assert desk.wake_at == late
    desk.until(late)
    assert desk.report.faults == (Fault("LIFT_SILENT", "no LiftState comes"),)


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


def shown_each_second(desk: Alone, session: str, until: int) -> tuple[Fault, ...]:
    """The faults after states that show this session from now until then."""
    for second in range(int(desk.now), until + 1):
        desk.until(float(second))
        desk.shows(session, "L1", to="L3")
    return desk.report.faults


def test_each_alarm_says_which_session_it_is_about() -> None:
    never_taken = Alone(Limits(silent_after_s=60.0))
    never_taken.asks("a")
    assert shown_each_second(never_taken, "", 30) == (
        Fault("NOT_GRANTED", "the lift does not take a"),
    )
    desk = Alone(Limits(holder_alarm_s=20.0))
    desk.asks("a")
    assert shown_each_second(desk, "a", 20) == (Fault("HOLDER_SILENT", "no request from a"),)
    desk.ends("a")
    assert shown_each_second(desk, "a", 50) == (
        Fault("END_NOT_OBEYED", "the lift does not release a"),
    )


def test_a_request_may_be_as_old_as_our_uptime_or_as_the_yaml_says_if_clocks_agree() -> None:
    memory = Memory("Lift1", started_at=100.0)
    assert memory.rules(130.0, Limits()) == Rules(30.0, future_s=FUTURE_S)
    speaks = Memory("Lift1", started_at=100.0, may_speak=True)
    assert speaks.rules(130.0, Limits()) == Rules(30.0, future_s=NEVER)
    agreed = Limits(clock_synchronised=True, max_request_age_s=7.0)
    assert memory.rules(130.0, agreed) == Rules(7.0, known_clocks=False)


def test_states_count_as_flowing_until_exactly_three_seconds_after_the_last() -> None:
    state = StateHeard("", "L1", "", 0, 2)
    memory = Memory("Lift1", 0.0, shown=state, shown_at=10.0)
    assert [memory.flows(now) for now in (13.0, 13.1)] == [True, False]


def test_the_limits_come_from_the_yaml() -> None:
    settings = Settings(
        silent_after_s=11.0,
        quiet_start_s=4.0,
        holder_alarm_s=61.0,
        holder_ttl_s=600.0,
        clock_synchronised=True,
        max_request_age_s=9.0,
    )
    assert Limits.of(settings) == Limits(11.0, 4.0, 61.0, 600.0, True, 9.0)
    assert Limits.of(Settings()).holder_ttl_s == NEVER
