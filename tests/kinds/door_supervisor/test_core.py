"""The door supervisor's rules, each tested alone. Tests compare all messages to the door's node."""

from itertools import pairwise

import pytest
from msgspec.structs import replace

from bridges.kinds.door_supervisor import core
from bridges.kinds.door_supervisor.memory import VISIT_S, DoorSupervisorLimits, Holder
from bridges.kinds.door_supervisor.report import DoorHoldReport
from bridges.kinds.door_supervisor.signals import RequesterCloses, RequesterOpens
from bridges.kinds.shared.graph_kind import MaySpeak
from bridges.messages.definitions import DoorModeValue
from tests.kinds.door_supervisor.alone import Alone

# ---- DOOR-SUPERVISOR-1, DOOR-SUPERVISOR-2: holders, OPEN and CLOSE


def test_open_is_sent_for_the_first_holder_and_close_after_the_last_holder() -> None:
    desk = Alone()
    desk.opens("a")
    desk.until(2.0)
    desk.opens("b")
    desk.until(4.0)
    desk.closes("a")
    desk.until(6.0)
    desk.closes("b")
    desk.until(60.0)
    assert desk.sent == [(0.0, "OPEN"), (2.0, "OPEN"), (6.0, "CLOSED")]


def test_a_request_that_counts_is_not_refused() -> None:
    desk = Alone()
    desk.opens()
    desk.shows("OPEN")
    desk.until(0.5)
    desk.closes()
    desk.shows("CLOSED")
    assert (desk.sent, desk.refused) == ([(0.0, "OPEN"), (0.5, "CLOSED")], [])


# ---- DOOR-SUPERVISOR-3: requesters or a door that send nothing


def test_silence_and_time_close_nothing() -> None:
    desk = Alone(DoorSupervisorLimits(open_alarm_s=86400.0))
    desk.opens()
    desk.shows("OPEN", until=4000.0)
    assert desk.sent == [(float(s), "OPEN") for s in range(6)]
    assert desk.holders == ["a"]


# ---- DOOR-SUPERVISOR-2, DOOR-SUPERVISOR-5: repeats


def test_repeats_of_a_requester_are_passed_on_at_most_once_a_second() -> None:
    desk = Alone()
    for tenth in range(35):
        desk.until(tenth / 10)
        desk.opens("ab"[tenth % 2])
    assert desk.sent == [(0.0, "OPEN"), (1.0, "OPEN"), (2.0, "OPEN"), (3.0, "OPEN")]


def test_a_state_before_the_repeat_is_due_does_not_cancel_the_repeat_of_a_requester() -> None:
    desk = Alone()
    desk.opens()
    desk.shows("OPEN", until=8.0)
    desk.opens()
    desk.until(8.5)
    desk.opens()
    desk.shows("OPEN")
    desk.until(20.0)
    assert desk.sent[-2:] == [(8.0, "OPEN"), (9.0, "OPEN")]


@pytest.mark.parametrize("mode", ["OFFLINE", "UNKNOWN", None])
def test_open_is_repeated_once_when_a_held_door_comes_back(mode: str | None) -> None:
    """Its node may have let the door go in a fire, while a person kept the leaf open."""
    desk = Alone()
    desk.opens()
    desk.shows("OPEN", until=8.0)
    if mode:
        desk.shows(mode, until=12.0)
    desk.until(12.5)
    desk.shows("OPEN", until=20.0)
    assert desk.sent[-2:] == [(5.0, "OPEN"), (12.5, "OPEN")]


@pytest.mark.parametrize("mode", ["CLOSED", "MOVING"])
def test_open_is_repeated_at_each_state_of_a_held_door_that_is_not_open(mode: str) -> None:
    desk = Alone()
    desk.opens()
    desk.shows(mode, until=8.0)
    assert desk.sent == [(float(s), "OPEN") for s in range(9)]


@pytest.mark.parametrize("mode", ["OPEN", "MOVING"])
def test_close_is_repeated_until_a_door_without_holders_is_closed(mode: str) -> None:
    desk = Alone()
    desk.shows(mode, until=2.0)
    desk.shows("CLOSED", until=5.0)
    assert desk.sent == [(0.0, "CLOSED"), (1.0, "CLOSED"), (2.0, "CLOSED")]


def test_states_at_10_hz_cause_reminders_at_1_hz() -> None:
    desk = Alone()
    for tenth in range(31):
        desk.until(tenth / 10)
        desk.shows("OPEN")
    assert desk.sent == [(0.0, "CLOSED"), (1.0, "CLOSED"), (2.0, "CLOSED"), (3.0, "CLOSED")]


@pytest.mark.parametrize("mode", ["OFFLINE", "UNKNOWN"])
def test_no_request_is_repeated_to_a_door_in_an_unknown_state(mode: str) -> None:
    desk = Alone()
    desk.shows(mode, until=3.0)
    desk.opens()
    desk.until(8.5)
    desk.shows(mode, until=20.0)
    desk.until(20.5)
    desk.closes()
    desk.shows(mode, until=30.0)
    assert desk.sent == [(3.0, "OPEN"), (20.5, "CLOSED")]


def test_a_door_that_was_offline_gets_open_again_for_its_holder() -> None:
    desk = Alone()
    desk.opens()
    desk.until(6.0)
    desk.shows("OFFLINE", until=20.0)
    desk.until(20.25)
    desk.shows("CLOSED")
    assert desk.sent == [(0.0, "OPEN"), (20.25, "OPEN")]


def test_open_is_repeated_for_5_s_because_a_message_may_be_lost_or_a_close_late() -> None:
    desk = Alone()
    desk.opens("b")
    desk.until(10.0)
    desk.closes("b")
    desk.until(10.5)
    desk.opens("a")
    desk.shows("OPEN", until=30.0)
    assert desk.sent[1:] == [
        (10.0, "CLOSED"),
        *[(at + 0.5, "OPEN") for at in (10, 11, 12, 13, 14, 15)],
    ]


def test_a_new_holders_open_is_sent_although_the_door_still_shows_open() -> None:
    desk = Alone()
    desk.opens("a")
    desk.until(10.0)
    desk.closes("a")
    desk.until(10.05)
    desk.opens("b")
    desk.shows("OPEN")
    desk.until(10.5)
    assert desk.sent == [(0.0, "OPEN"), (10.0, "CLOSED"), (10.1, "OPEN")]


def test_quick_changes_are_sent_at_most_at_10_hz_and_the_last_change_is_always_sent() -> None:
    desk = Alone()
    for hundredth in range(100):
        desk.until(hundredth / 100)
        desk.opens() if hundredth % 2 else desk.closes()
    desk.until(3.0)
    assert [at for at, _ in desk.sent] == sorted({at for at, _ in desk.sent})
    gaps = [b - a for (a, _), (b, _) in pairwise(desk.sent)]
    assert min(gaps) >= 0.1 - 1e-9
    assert desk.sent[-1][1] == "OPEN"


def test_the_last_close_cancels_a_repeat_that_was_due() -> None:
    desk = Alone()
    desk.opens()
    desk.until(0.5)
    desk.opens()
    desk.until(0.55)
    desk.closes()
    desk.until(5.0)
    assert desk.sent == [(0.0, "OPEN"), (0.55, "CLOSED")]


def test_a_close_of_one_holder_changes_nothing_for_another_holder() -> None:
    desk = Alone()
    desk.opens("a")
    desk.opens("b")
    desk.until(0.5)
    desk.closes("a")
    desk.until(5.0)
    assert desk.sent == [(0.0, "OPEN"), (1.0, "OPEN")]


def test_a_close_from_a_requester_that_does_not_hold_the_door_is_ignored() -> None:
    desk = Alone()
    desk.opens("a")
    desk.closes("b")
    desk.until(0.5)
    assert (desk.sent, desk.holders) == ([(0.0, "OPEN")], ["a"])


# ---- DOOR-SUPERVISOR-1, FRESHNESS-1, FRESHNESS-3, FRESHNESS-5: late, repeated and reordered requests


def test_a_late_close_does_not_end_the_next_visit() -> None:
    desk = Alone()
    desk.opens()
    desk.until(3.0)
    desk.closes(aged=4.0)
    assert desk.holders == ["a"]
    assert desk.refused == [(3.0, "stale request")]


def test_a_late_or_doubled_open_adds_no_holder() -> None:
    desk = Alone()
    desk.opens()
    desk.until(3.0)
    desk.closes()
    desk.until(4.0)
    desk.opens(aged=4.0)
    desk.until(5.0)
    assert (desk.sent, desk.holders) == ([(0.0, "OPEN"), (3.0, "CLOSED")], [])


def test_an_open_that_its_own_close_has_overtaken_opens_nothing() -> None:
    desk = Alone()
    desk.until(1.0)
    desk.closes()
    desk.opens(aged=0.5)
    assert (desk.sent, desk.holders) == ([], [])


def test_the_clocks_of_requesters_are_compared_separately() -> None:
    desk = Alone()
    desk.opens("a")
    desk.opens("b", aged=50.0)
    desk.until(1.0)
    desk.closes("b", aged=50.0)
    assert desk.holders == ["a"]


def test_a_requester_without_stamps_is_believed_in_the_order_of_arrival() -> None:
    desk = Alone()
    words: list[type[RequesterOpens | RequesterCloses]] = [RequesterOpens, RequesterOpens]
    words += [RequesterCloses, RequesterOpens, RequesterCloses]
    for at, word in enumerate(words):
        desk.until(float(at))
        desk.hears(word("terminal", 0))
    assert desk.sent == [
        (0.0, "OPEN"),
        (1.0, "OPEN"),
        (2.0, "CLOSED"),
        (3.0, "OPEN"),
        (4.0, "CLOSED"),
    ]


def test_a_requester_whose_clock_was_set_back_is_believed_again_after_10_s() -> None:
    desk = Alone()
    desk.opens()
    for second in range(20, 31):
        desk.until(float(second))
        assert desk.holders == ["a"]
        desk.closes(aged=90.0)
    assert desk.sent == [(0.0, "OPEN"), (30.0, "CLOSED")]
    desk.until(31.0)
    desk.opens(aged=90.0)
    assert desk.holders == ["a"]


def test_a_holder_whose_clock_was_set_back_can_leave_again_at_once_when_it_is_believed() -> None:
    desk = Alone()
    desk.opens()
    for second in range(20, 31):
        desk.until(float(second))
        desk.opens(aged=90.0)
    desk.closes(aged=90.0)
    assert desk.holders == []


def test_late_messages_with_a_break_or_the_same_stamp_are_never_taken_for_a_clock_set_back() -> (
    None
):
    desk = Alone()
    desk.opens()
    for second in (1, 2, 3, 4, 8, 9, 10, 11):
        desk.until(float(second))
        desk.closes(aged=50.0)
    for second in range(12, 40):
        desk.until(float(second))
        desk.hears(RequesterCloses("a", 1))
    assert desk.holders == ["a"]


def test_one_timely_request_ends_the_doubt_about_a_clock() -> None:
    desk = Alone()
    desk.opens()
    for second in range(1, 20):
        desk.until(float(second))
        desk.closes(aged=50.0)
        if second == 9:
            desk.opens()
    assert desk.holders == ["a"]


def test_a_requester_is_forgotten_after_a_minute_but_a_holder_never() -> None:
    desk = Alone()
    desk.opens("a")
    desk.opens("b")
    desk.closes("b")
    desk.until(60.0)
    desk.opens("c")
    assert set(desk.memory.requesters) == {"a", "c"}


def test_many_invented_names_are_refused_but_the_holder_is_heard() -> None:
    desk = Alone()
    desk.opens("a")
    for n in range(300):
        desk.opens(f"n{n}")
    assert len(desk.memory.requesters) == 200
    assert desk.refused == [(0.0, "too many requesters")] * 101
    desk.until(1.0)
    desk.closes("a")
    assert "a" not in desk.holders


def test_a_repeat_in_time_belongs_to_the_same_visit() -> None:
    holder = Holder("fleet/a", since=1.0, asked_at=5.0, stamp=7, visit=3)
    late = 5.0 + VISIT_S
    assert holder.repeats(8, late) == replace(holder, asked_at=late, stamp=8)
    assert holder.repeats(8, late + 0.1) == replace(holder, asked_at=late + 0.1, stamp=8, visit=8)


# ---- DOOR-SUPERVISOR-4: permission to publish


def test_after_its_quiet_start_it_first_sends_open_for_each_holder() -> None:
    desk = Alone(speaks=False)
    desk.shows("MOVING")
    desk.opens()
    desk.shows("OPEN", until=3.0)
    assert desk.sent == []
    desk.hears(MaySpeak(True))
    desk.until(10.0)
    assert desk.sent == [(3.0, "OPEN")]


def test_a_close_heard_in_the_quiet_start_is_sent_after_the_next_state() -> None:
    desk = Alone(speaks=False)
    desk.opens()
    desk.shows("OPEN", until=2.0)
    desk.closes()
    desk.until(3.0)
    desk.hears(MaySpeak(True))
    desk.until(3.5)
    assert desk.sent == []
    desk.shows("OPEN")
    assert desk.sent == [(3.5, "CLOSED")]


def test_beside_another_supervisor_ours_sends_nothing_and_keeps_its_table() -> None:
    desk = Alone()
    desk.opens("a")
    desk.until(1.0)
    desk.hears(MaySpeak(False, waits="for /other to go"))
    desk.opens("b")
    assert desk.report.waits == "for /other to go"
    desk.closes("a")
    desk.shows("MOVING", until=20.0)
    assert desk.sent == [(0.0, "OPEN")]
    desk.hears(MaySpeak(True))
    assert (desk.sent, desk.holders) == ([(0.0, "OPEN"), (20.0, "OPEN")], ["b"])
    assert desk.report.waits == ""


# ---- DOOR-SUPERVISOR-3: the report


def test_a_door_held_too_long_by_one_requester_causes_only_a_fault() -> None:
    desk = Alone(DoorSupervisorLimits(open_alarm_s=20.0))
    desk.opens("web")
    desk.shows("OPEN", until=15.0)
    desk.opens("a")
    desk.shows("OPEN", until=40.0)
    desk.closes("web")
    desk.until(41.0)
    desk.closes("a")
    assert desk.faults == [
        (20.0, ("DOOR_HELD_OPEN: longer than 20 s by web",)),
        (35.0, ("DOOR_HELD_OPEN: longer than 20 s by web, a",)),
        (40.0, ("DOOR_HELD_OPEN: longer than 20 s by a",)),
        (41.0, ()),
    ]
    assert [word for at, word in desk.sent if at < 41.0].count("CLOSED") == 0


def test_repeats_do_not_delay_the_alarm_but_a_new_visit_restarts_its_time() -> None:
    desk = Alone(DoorSupervisorLimits(open_alarm_s=20.0))
    for second in range(45):
        desk.until(float(second))
        desk.closes() if second == 15 else desk.opens()
        desk.shows("OPEN")
    assert desk.faults == [(36.0, ("DOOR_HELD_OPEN: longer than 20 s by a",))]


def test_the_alarm_for_a_long_hold_needs_no_message() -> None:
    desk = Alone(DoorSupervisorLimits(open_alarm_s=20.0))
    desk.opens()
    desk.until(100.0)
    silent, held = "DOOR_SILENT: no DoorState comes", "DOOR_HELD_OPEN: longer than 20 s by a"
    assert desk.faults == [(3.0, (silent,)), (20.0, (held, silent))]


def test_a_held_door_without_states_is_a_fault() -> None:
    desk = Alone()
    desk.shows("OPEN", until=5.0)
    desk.opens()
    desk.until(20.0)
    desk.shows("OPEN")
    assert desk.faults == [(8.0, ("DOOR_SILENT: no DoorState comes",)), (20.0, ())]


def test_a_silent_door_without_holders_is_forgotten_after_a_minute() -> None:
    desk = Alone()
    desk.shows("CLOSED")
    desk.until(30.0)
    desk.opens()
    desk.closes()
    assert desk.faults == []
    assert not core.idle(desk.memory, 89.0)
    assert core.idle(desk.memory, 90.0)
    desk.opens()
    assert not core.idle(desk.memory, 1000.0)


def test_the_report_names_the_holders_and_the_door_as_it_was_last_seen() -> None:
    desk = Alone()
    assert desk.report == DoorHoldReport(None)
    desk.until(1.0)
    desk.opens("b")
    desk.until(2.0)
    desk.shows("MOVING")
    desk.opens("a")
    report = desk.report
    assert report == DoorHoldReport(2.0, DoorModeValue.MODE_MOVING, (("b", 1.0), ("a", 2.0)))
    assert report.news() == (DoorModeValue.MODE_MOVING, ("b", "a"))


def test_a_holder_that_repeats_itself_does_not_displace_another() -> None:
    desk = Alone()
    desk.opens("a")
    desk.opens("b")
    desk.opens("a")
    assert desk.holders == ["a", "b"]
