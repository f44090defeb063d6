"""LIFT-SUPERVISOR-2, LIFT-SUPERVISOR-4: the session to which the lift is granted, and requesters that
have disappeared."""

import math

from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import SILENT_S
from tests.kinds.lift_supervisor.alone import Alone

# ---- LIFT-SUPERVISOR-2: the session that really has the lift


def test_a_session_that_the_lift_shows_comes_before_the_queue_if_its_robot_asks() -> None:
    desk = Alone()
    desk.asks("b", "L1")
    desk.shows("a", "L2")
    desk.until(0.5)
    desk.asks("a", "L3")
    assert (desk.report.holder, desk.waiting) == ("a", ["b"])
    assert desk.sent == [(0.0, "AGV b L1"), (0.5, "AGV a L3")]


def test_a_short_silence_ends_no_holder_even_if_the_lift_daemon_lost_the_session() -> None:
    desk = Alone()
    desk.shows("a", "L2")
    desk.asks("a")
    for second in range(1, 20):
        desk.until(float(second))
        desk.shows("", "L2")
    assert {text for _, text in desk.sent} == {"AGV a L3"}


def test_no_request_goes_to_a_lift_that_shows_the_session_of_a_stranger() -> None:
    desk = Alone()
    desk.asks("b")
    for second in range(1, 4):
        desk.until(float(second))
        desk.shows("a", "L2")
        desk.asks("b")
    assert desk.sent == [(0.0, "AGV b L3")]


def test_a_session_that_no_robot_requests_for_3_s_is_ended() -> None:
    desk = Alone()
    for second in range(5):
        desk.until(float(second))
        desk.shows("a", "L2")
    desk.until(5.0)
    desk.shows("", "L2")
    assert desk.sent == [(3.0, "END a L2"), (4.0, "END a L2")]


def test_after_a_silence_of_the_lift_the_session_of_a_stranger_gets_its_3_s_again() -> None:
    desk = Alone()
    desk.shows("a")
    desk.until(1.0)
    desk.shows("a")
    desk.until(60.0)
    assert desk.sent == []
    desk.shows("a")
    desk.until(62.9)
    desk.shows("a")
    assert desk.sent == []
    desk.until(63.0)
    desk.shows("a")
    assert desk.sent == [(63.0, "END a L1")]


def test_a_state_in_the_last_instant_prevents_the_silence_of_a_lift() -> None:
    def session_since(seconds: float) -> float:
        desk = Alone()
        desk.shows("a", "L2")
        desk.until(seconds)
        desk.shows("a", "L2")
        return desk.memory.session_since

    late = math.nextafter(SILENT_S, math.inf)
    assert (session_since(SILENT_S), session_since(late)) == (0.0, late)


def test_a_session_that_the_node_lost_in_a_restart_is_requested_again_for_its_holder() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ride("a")
    desk.until(5.0)
    desk.shows("", "L3")
    assert desk.sent == [(0.0, "AGV a L3"), (5.0, "AGV a L3")]


# ---- LIFT-SUPERVISOR-4: requesters that have gone


def test_a_holder_that_never_got_the_lift_is_ended_after_10_s_of_silence() -> None:
    desk = Alone()
    desk.shows("")
    desk.asks("a")
    for second in range(1, 12):
        desk.until(float(second))
        desk.shows("", "L1")
        desk.asks("b", "L1")
    asked = [(float(second), "AGV a L3") for second in range(10)]
    assert desk.sent == [*asked, (10.0, "END a L1"), (10.1, "AGV b L1")]


def test_a_silent_holder_keeps_the_lift_and_raises_an_alarm_after_a_minute() -> None:
    desk = Alone()
    desk.asks("a")
    desk.ride("a")
    for second in range(1, 3600):
        desk.until(float(second))
        desk.ride("a")
        assert desk.faults == (["HOLDER_SILENT"] if second >= 60 else [])
    assert desk.sent == [(0.0, "AGV a L3")]
    desk.asks("a")
    assert desk.faults == []


def test_with_the_setting_a_silent_holder_is_ended_after_its_time() -> None:
    desk = Alone(LiftSupervisorLimits(holder_ttl_s=120.0))
    desk.asks("a")
    desk.ride("a")
    for second in range(1, 122):
        desk.until(float(second))
        desk.ride("a")
    assert desk.sent == [(0.0, "AGV a L3"), (120.0, "END a L3"), (121.0, "END a L3")]


def test_a_silent_holder_does_not_wait_in_the_queue_after_its_turn() -> None:
    desk = Alone(LiftSupervisorLimits(holder_ttl_s=5.0, holder_alarm_s=2.0))
    desk.asks("a")
    for second in range(6):
        desk.until(float(second))
        desk.shows("a", "L1", to="L3")
    assert (desk.report.holder, desk.report.ending, desk.waiting) == ("a", True, [])


def test_a_lift_that_does_not_take_the_holder_or_does_not_release_it_raises_an_alarm() -> None:
    desk = Alone()
    for second in range(31):
        desk.until(float(second))
        desk.shows("")
        desk.asks("a")
    assert desk.faults == ["NOT_GRANTED"]
    desk.ends("a", aged=-0.5)
    for second in range(31, 62):
        desk.until(float(second))
        desk.shows("a")
        assert desk.faults == (["END_NOT_OBEYED"] if second >= 60 else [])


def shown_each_second(desk: Alone, session: str, until: int) -> tuple[Fault, ...]:
    """Let a LiftState with this session arrive each second until the time `until`. Return the last
    faults."""
    for second in range(int(desk.now), until + 1):
        desk.until(float(second))
        desk.shows(session, "L1", to="L3")
    return desk.report.faults


def test_each_alarm_names_its_session() -> None:
    never_taken = Alone(LiftSupervisorLimits(silent_after_s=60.0))
    never_taken.asks("a")
    assert shown_each_second(never_taken, "", 30) == (
        Fault("NOT_GRANTED", "the lift does not take a"),
    )
    desk = Alone(LiftSupervisorLimits(holder_alarm_s=20.0))
    desk.asks("a")
    assert shown_each_second(desk, "a", 20) == (Fault("HOLDER_SILENT", "no request from a"),)
    desk.ends("a")
    assert shown_each_second(desk, "a", 50) == (
        Fault("END_NOT_OBEYED", "the lift does not release a"),
    )
