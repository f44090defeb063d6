"""When the supervisor must not send: in a hazard, in the quiet time after its start, and beside a
second supervisor. The tests also cover stale requests."""

import pytest
from msgspec.structs import replace

from bridges.kinds.lift_supervisor import core
from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits, SessionClaim, SupervisedLift
from bridges.kinds.lift_supervisor.report import SupervisorReport
from bridges.kinds.lift_supervisor.signals import RideEnded, RideRequested, Target
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.freshness import FUTURE_S, Rules
from bridges.kinds.shared.graph_kind import MaySpeak
from tests.kinds.lift_supervisor.alone import Alone

TO_L3 = Target(1, "L3", 2)


# ---- LIFT-SUPERVISOR-5: hazards


@pytest.mark.parametrize("mode", ["FIRE", "OFFLINE"])
def test_in_a_hazard_no_request_is_sent_and_no_queue_moves(mode: str) -> None:
    desk = Alone()
    desk.shows("", mode=mode)
    desk.asks("a")
    for second in range(1, 40):
        desk.until(float(second))
        desk.shows("", mode=mode)
        desk.asks("a")
    assert (desk.sent, desk.waiting, desk.faults) == ([], ["a"], [])
    desk.until(40.0)
    desk.shows("")
    assert desk.sent == [(40.0, "AGV a L3")]


def test_in_a_hazard_a_request_of_the_holder_is_held_back_but_its_end_is_sent() -> None:
    desk = Alone()
    desk.asks("a")
    for second in range(1, 40):
        desk.until(float(second))
        desk.shows("a", "L1", to="L3", mode="FIRE")
        desk.asks("a", "L1")
    assert (desk.sent, desk.faults) == ([(0.0, "AGV a L3")], [])
    desk.ends("a", aged=-0.1)
    desk.until(40.0)
    desk.shows("a", "L1", to="L3", mode="FIRE")
    assert desk.sent == [(0.0, "AGV a L3"), (39.0, "END a L1"), (40.0, "END a L1")]


def test_a_holder_that_had_not_got_the_lift_is_sent_after_the_hazard() -> None:
    desk = Alone()
    desk.asks("a")
    for second in range(1, 40):
        desk.until(float(second))
        desk.shows("", mode="FIRE")
        desk.asks("a")
    assert (desk.sent, desk.faults) == ([(0.0, "AGV a L3")], [])
    desk.until(40.0)
    desk.shows("")
    assert desk.sent == [(0.0, "AGV a L3"), (40.0, "AGV a L3")]


def test_a_holders_human_mode_is_passed_on_in_a_hazard() -> None:
    desk = Alone()
    desk.asks("a")
    desk.shows("a", "L1", to="L3", mode="FIRE")
    desk.until(1.0)
    desk.asks("a", "L1", kind=2)
    assert desk.sent == [(0.0, "AGV a L3"), (1.0, "HUMAN a L1")]


# ---- LIFT-SUPERVISOR-6: without permission to publish


def test_after_its_quiet_start_the_supervisor_continues_the_ride_in_progress() -> None:
    desk = Alone(speaks=False)
    desk.asks("b", "L1")
    for second in (0.5, 1.5, 2.5):
        desk.until(second)
        desk.shows("a", "L1", to="L3")
        desk.asks("a")
    assert desk.sent == []
    desk.until(3.0)
    desk.hears(MaySpeak(True))
    assert (desk.report.holder, desk.waiting) == ("a", ["b"])
    assert desk.sent == [(3.0, "AGV a L3")]


def test_after_the_quiet_start_a_session_that_nobody_requests_is_ended() -> None:
    desk = Alone(speaks=False)
    for second in (0.0, 1.0, 2.0, 3.0):
        desk.until(second)
        desk.shows("a", "L2")
    desk.hears(MaySpeak(True))
    assert desk.sent == [(3.0, "END a L2")]


def test_an_end_in_the_quiet_time_removes_the_robots_claim() -> None:
    desk = Alone(speaks=False)
    desk.asks("a")
    desk.until(1.0)
    desk.ends("a")
    desk.hears(MaySpeak(True))
    desk.until(5.0)
    assert desk.sent == []


def test_beside_another_supervisor_an_end_of_the_session_that_has_the_lift_is_not_sent_later() -> (
    None
):
    desk = Alone()
    desk.asks("a")
    desk.ride("a")
    desk.until(1.0)
    desk.hears(MaySpeak(False))
    desk.ends("a")
    desk.shows("", "L3")
    desk.hears(MaySpeak(True))
    desk.until(5.0)
    assert (desk.report.holder, desk.sent) == ("", [(0.0, "AGV a L3")])
    assert core.wanted(desk.memory) is None


def test_a_session_keeps_its_turn_if_only_other_topics_have_another_publisher() -> None:
    desk = Alone()
    desk.asks("a")
    desk.until(1.0)
    desk.hears(MaySpeak(True, alone=False))
    assert (desk.report.holder, desk.report.since) == ("a", 0.0)


def test_the_lifts_node_is_told_that_a_person_has_ended_the_session() -> None:
    """DOOR_OPEN in an END means this (`bridges/kinds/lift/messages.py`)."""

    def door(*, by_person: bool) -> int:
        desk = Alone()
        desk.asks("a")
        desk.ride("a")
        desk.until(1.0)
        desk.hears(RideEnded("a", desk.stamped(0.0), -desk.skew, by_person=by_person))
        end = core.wanted(desk.memory)
        assert end is not None
        return end.door_state

    assert (door(by_person=True), door(by_person=False)) == (2, 0)


def test_a_person_ends_a_session_whose_end_the_lift_does_not_obey() -> None:
    """The lift keeps a robot in the car that goes on asking. Only a person's END ends that session. A
    repeated END does not put off the fault END_NOT_OBEYED."""
    desk = Alone()
    desk.asks("a")
    desk.ride("a")
    desk.until(1.0)
    ends = ((False, 0, 2.0), (False, 0, 2.0), (True, 2, 4.0), (False, 2, 4.0), (True, 2, 4.0))
    for by_person, door, since in ends:
        desk.until(desk.now + 1.0)
        desk.hears(RideEnded("a", desk.stamped(0.0), -desk.skew, by_person=by_person))
        end = core.wanted(desk.memory)
        assert end is not None
        assert (end.door_state, desk.report.since) == (door, since)


def test_beside_another_supervisor_ours_is_silent_and_afterwards_follows_the_shown_state() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ride("a")
    desk.until(1.0)
    desk.hears(MaySpeak(False))
    assert desk.report.holder == ""
    for second in range(2, 6):
        desk.until(float(second))
        desk.shows("b", "L1")
        desk.asks("b", "L1")
        desk.asks("a", "L2")
    desk.hears(MaySpeak(True))
    assert (desk.report.holder, desk.waiting) == ("b", ["a"])
    assert desk.sent == [(0.0, "AGV a L3"), (5.0, "AGV b L1")]


def test_nothing_is_sent_before_sending_is_allowed() -> None:
    assert not core.initial("Lift1", 0.0).may_speak


# ---- FRESHNESS-1, FRESHNESS-2, FRESHNESS-4: stale requests


def test_requests_from_before_our_start_count_once_they_are_repeated() -> None:
    desk = Alone()
    desk.skew = -3600.0
    desk.asks("a", "L1", aged=60.0)
    desk.asks("a", "L2", aged=30.0)
    assert (desk.sent, desk.refused) == ([], [(0.0, "stale request")] * 2)
    desk.until(1.0)
    desk.asks("a", "L3")
    assert desk.sent == [(1.0, "AGV a L3")]


def test_a_request_older_than_the_newest_of_its_requester_is_stale() -> None:
    desk = Alone()
    desk.until(10.0)
    desk.asks("a", "L3")
    desk.asks("a", "L1", aged=2.0)
    desk.until(11.0)
    assert desk.sent == [(10.0, "AGV a L3")]
    assert desk.refused == [(10.0, "stale request")]


def test_with_synchronised_clocks_a_young_request_from_before_our_start_counts_at_once() -> None:
    desk = Alone(LiftSupervisorLimits(clock_synchronised=True))
    desk.asks("a", "L3", aged=9.0)
    desk.asks("b", "L3", aged=11.0)
    desk.until(60.0)
    desk.asks("a", "L1", aged=11.0)
    assert [text for _, text in desk.sent] == ["AGV a L3", "END a"]
    assert desk.refused == [(0.0, "stale request"), (60.0, "stale request")]


def test_with_synchronised_clocks_the_uptime_or_the_yaml_limits_the_age_of_a_request() -> None:
    memory = SupervisedLift("Lift1", started_at=100.0)
    assert memory.rules(130.0, LiftSupervisorLimits()) == Rules(30.0, future_s=FUTURE_S)
    speaks = SupervisedLift("Lift1", started_at=100.0, may_speak=True)
    assert speaks.rules(130.0, LiftSupervisorLimits()) == Rules(30.0, future_s=NEVER)
    agreed = LiftSupervisorLimits(clock_synchronised=True, max_request_age_s=7.0)
    assert memory.rules(130.0, agreed) == Rules(7.0, known_clocks=False)


def test_a_request_from_the_future_is_not_believed_in_the_quiet_time() -> None:
    """The supervisor's clock is not set yet. So the stamps of old requests can be later than its
    time."""
    desk = Alone(speaks=False)
    desk.skew = 3600.0
    desk.asks("a")
    desk.hears(MaySpeak(True))
    desk.asks("b")
    assert desk.sent == [(0.0, "AGV b L3")]


# --- the report --------------------------------------------------------------------------------


def test_the_report_names_the_holder_and_each_waiting_robot_with_its_time() -> None:
    desk = Alone()
    assert desk.report == SupervisorReport(None)
    desk.until(1.0)
    desk.asks("a")
    desk.shows("a")
    assert desk.report == SupervisorReport(1.0, "a", "a", 1.0)
    desk.until(2.0)
    desk.asks("b")
    desk.shows("a")
    waiting = (("b", 2.0),)
    held = SupervisorReport(2.0, "a", "a", 1.0, False, waiting, waits="for END of a")
    assert desk.report == held
    desk.until(3.0)
    desk.ends("a")
    ending = replace(held, since=3.0, ending=True, waits="for the lift to release a")
    assert desk.report == ending
    assert desk.report.news() == ("a", "a", True, ("b",))


def test_a_request_is_remembered_as_it_was_last_asked() -> None:
    desk = Alone()
    desk.hears(RideRequested("a", TO_L3, 1.0, 0.0))
    assert desk.memory.claims == (SessionClaim("a", TO_L3, 0.0, 0.0),)
