"""Whole histories of the charger's core in virtual time. The core gets one reading a second."""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger import core
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerDurations, ChargerSettings, robot
from bridges.kinds.charger.signals import (
    Activity,
    Cancelled,
    ChargeRequested,
    ChargerOutputs,
    ChargerSample,
    Measured,
)
from bridges.kinds.shared.decision import Fault, Sampled
from bridges.messages.definitions import ChargerStateValue as State
from tests.kinds.charger.story import (
    AMR1,
    AMR2,
    CANCEL_1,
    CHARGING,
    FULL,
    IDLE,
    LIMITS,
    RESET,
    RIVAL,
    SILENT,
    Story,
    measured,
    observed,
)

# ---- CHARGER-1: the states


def test_a_scheduled_charge_passes_every_state_and_ends_idle() -> None:
    story = Story().polls("idle 2").event(AMR1)
    story.polls("idle 10, handshake 3, charging 60, stopping 2, released 3, idle 4")
    assert story.told == [
        (0.0, "IDLE", ""),
        (2.0, "ASSIGNED", "req-1"),
        (15.0, "CHARGING", "req-1"),
        (77.0, "RELEASED", "req-1"),
        (80.0, "IDLE", ""),
    ]
    assert story.faults == []
    assert story.refused == []


def test_an_ad_hoc_request_of_a_robot_already_in_the_handshake_is_granted() -> None:
    story = Story().polls("handshake 2").event(AMR1).polls("handshake 1, charging 2")
    assert story.told == [
        (0.0, "IDLE", ""),
        (2.0, "ASSIGNED", "req-1"),
        (3.0, "CHARGING", "req-1"),
    ]


def test_every_state_except_idle_names_the_robot_and_its_request() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("idle 1")
    assert story.report == ChargerReport(
        read_at=1.0,
        state=State.CHARGER_ASSIGNED,
        request_id="req-1",
        fleet="tiny",
        robot="AMR01",
        waits="for the station to charge tiny/AMR01",
    )


def test_the_limits_have_the_yamls_receivers_and_whether_the_station_obeys_power() -> None:
    class CannotStop(ChargerSettings, frozen=True, kw_only=True):
        def can_stop(self) -> bool:
            return False

    known = ChargerLimits.of(CannotStop(receivers={"rx-1": "tiny/AMR01"}, unrequested="refuse"))
    assert known == ChargerLimits(
        ChargerDurations(), {"rx-1": robot("tiny/AMR01")}, "refuse", can_stop=False
    )
    assert ChargerLimits.of(ChargerSettings()).can_stop


@pytest.mark.parametrize(
    ("measured", "reason"),
    [
        (Measured(receiver_id=""), "for tiny/AMR01 on the pad"),
        (Measured(receiver_id="rx-1", range_ok=False), "because the robot is not in range"),
        (Measured(receiver_id="rx-1", in_range=False), "for tiny/AMR01 in range"),
        (Measured(receiver_id="rx-1"), "for the station to charge tiny/AMR01"),
    ],
)
def test_a_waiting_request_names_what_it_waits_for(measured: Measured, reason: str) -> None:
    reading = Sampled(replace(IDLE.sample, measured=measured))
    story = Story(FULL).event(reading).event(AMR1).event(reading)
    assert story.report is not None
    assert (story.report.state, story.report.waits) == (State.CHARGER_ASSIGNED, reason)


def test_a_charge_whose_robot_leaves_its_range_says_why_it_gets_no_power() -> None:
    story = Story(FULL).sees((Activity.IDLE, "rx-1", 1)).event(AMR1)
    story.sees((Activity.CHARGING, "rx-1", 1))
    assert story.report is not None
    assert (story.outputs.power, story.report.waits) == (True, "")
    story.sees((Activity.CHARGING, "rx-1", 1), range_ok=False)
    assert story.outputs.power is False
    assert story.report.waits == "because the robot is not in range"


def test_time_to_full_and_measurements_are_reported_but_cause_no_message() -> None:
    story = Story().polls("idle 1").event(AMR1)
    reports = []
    for volts in (48.0, 48.5):
        story.event(measured(CHARGING.sample, volts=volts, time_to_full_s=600.0))
        assert story.report is not None
        reports.append(story.report)
    assert reports[0].measured == Measured(volts=48.0, time_to_full_s=600.0)
    assert reports[0] != reports[1]
    assert reports[0].news() == replace(reports[1], waits="for the robot").news()


def test_measurements_of_a_lost_station_are_not_shown() -> None:
    story = Story().event(measured(CHARGING.sample, volts=48.0)).polls("silent 3")
    assert story.report is not None
    assert story.report.measured == Measured()
    assert story.report.read_at == 0.0


def test_current_still_flowing_while_ramping_down_is_charging() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1, stopping 5, idle 1")
    assert story.told[2:] == [(1.0, "CHARGING", "req-1"), (7.0, "RELEASED", "req-1")]


# ---- CHARGER-2: requests


def test_a_repeated_request_changes_nothing() -> None:
    story = Story().polls("idle 1").event(AMR1)
    once = story.memory
    story.all([AMR1] * 3)
    assert story.memory == once
    assert story.refused == []


def test_a_repeat_does_not_prolong_the_start_timeout() -> None:
    story = Story().polls("idle 1")
    for _ in range(61):
        story.event(AMR1).polls("idle 1")
    assert story.told[-1] == (61.0, "RELEASED", "req-1")


def test_the_same_request_id_for_another_robot_is_refused() -> None:
    story = Story().polls("idle 1").event(AMR1).event(ChargeRequested("req-1", "tiny", "AMR02"))
    assert story.refused == [(1.0, "request_id of another robot")]
    assert story.report is not None
    assert story.report.robot == "AMR01"


@pytest.mark.parametrize("doing", ["idle 1", "charging 3", "charging 1, released 1", "silent 2"])
def test_a_second_robot_is_refused_while_the_first_has_the_station(doing: str) -> None:
    story = Story().polls("idle 1").event(AMR1).polls(doing)
    before = story.memory
    story.event(AMR2)
    assert story.memory == before
    assert [reason for _, reason in story.refused] == ["charger occupied"]


def test_a_second_request_of_the_same_robot_is_refused_during_the_first() -> None:
    story = Story().polls("idle 1").event(AMR1).event(ChargeRequested("req-3", "tiny", "AMR01"))
    assert story.refused == [(1.0, "charger occupied")]


def test_a_late_repeat_of_a_finished_request_starts_nothing() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 2, idle 4").event(AMR1)
    assert story.told[-1] == (5.0, "IDLE", "")
    assert story.refused == [(7.0, "request is over")]


def test_only_the_last_few_requests_are_remembered() -> None:
    story = Story().polls("idle 1")
    for n in range(20):
        story.event(ChargeRequested(f"r{n}", "tiny", "AMR01")).event(Cancelled(f"r{n}")).polls(
            "idle 3"
        )
    assert story.memory.over == tuple(f"r{n}" for n in range(12, 20))


@pytest.mark.parametrize("before", ["hot 1", "odd 1", "silent 3", "silent 1"])
def test_a_station_that_is_in_error_or_unread_takes_no_request(before: str) -> None:
    story = Story().polls(before).event(AMR1)
    assert [reason for _, reason in story.refused] == ["charger in error"]
    assert story.memory.holder is None


# ---- CHARGER-3: the start timeout


def test_a_request_without_a_charge_in_time_is_released_with_a_fault() -> None:
    asked = ChargeRequested("req-1", "tiny", "AMR01", start_timeout_s=5.0)
    story = Story().polls("idle 1").event(asked).polls("idle 10")
    assert story.told == [
        (0.0, "IDLE", ""),
        (1.0, "ASSIGNED", "req-1"),
        (6.0, "RELEASED", "req-1"),
        (8.0, "IDLE", ""),
    ]
    assert story.faults == ["START_TIMEOUT: tiny/AMR01 did not start to charge in time"]


def test_a_start_timeout_of_zero_means_the_configured_timeout() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("handshake 62")
    assert story.told[-1] == (61.0, "RELEASED", "req-1")


def test_a_charge_that_has_started_has_no_timeout() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 600")
    assert story.told[-1] == (1.0, "CHARGING", "req-1")


def test_a_coupling_that_is_lost_after_a_long_charge_gets_its_whole_start_timeout() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 100, handshake 59, charging 60")
    story.polls("handshake 61, idle 3")
    assert story.told[2:] == [
        (1.0, "CHARGING", "req-1"),
        (101.0, "ASSIGNED", "req-1"),
        (160.0, "CHARGING", "req-1"),
        (220.0, "ASSIGNED", "req-1"),
        (280.0, "RELEASED", "req-1"),
        (282.0, "IDLE", ""),
    ]


def test_a_charge_from_before_a_restart_that_loses_its_coupling_gets_its_whole_start_timeout() -> (
    None
):
    story = Story(FULL).sees((Activity.CHARGING, "rx-1", 2)).event(AMR1)
    story.sees((Activity.HANDSHAKE, "rx-1", 62))
    assert story.told[1:] == [
        (2.0, "CHARGING", "req-1"),
        (2.0, "ASSIGNED", "req-1"),
        (62.0, "RELEASED", "req-1"),
    ]


# ---- CHARGER-4: cancels


def test_a_cancel_before_charging_releases_the_station() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("idle 1").event(CANCEL_1).polls("idle 3")
    assert story.told[2:] == [(2.0, "RELEASED", "req-1"), (4.0, "IDLE", "")]
    assert story.faults == []


def test_a_cancel_during_a_charge_ends_the_power_and_shows_charging_until_the_current_ends() -> (
    None
):
    story = Story().polls("idle 1").event(AMR1).polls("charging 2")
    assert story.outputs.power is True
    story.event(CANCEL_1)
    assert story.outputs.power is False
    assert story.report is not None
    assert story.report.waits == "for the station to stop: cancelled"
    story.polls("charging 2, stopping 3, released 1, idle 2")
    assert story.told[2:] == [
        (1.0, "CHARGING", "req-1"),
        (8.0, "RELEASED", "req-1"),
        (10.0, "IDLE", ""),
    ]
    assert story.faults == []


def test_a_station_that_goes_on_charging_for_three_seconds_after_a_cancel_is_a_fault() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 2").event(CANCEL_1)
    assert story.polls("charging 3").faults == []
    assert story.polls("charging 1").faults == ["STILL_CHARGING: req-1: cancelled"]


def test_a_full_robot_that_is_still_charged_is_no_charge_against_an_order() -> None:
    full = measured(CHARGING.sample, battery_percent=100.0)
    story = Story().polls("idle 1").event(AMR1)
    for _ in range(10):
        story.event(full)
        story.now += 1.0
    assert (story.outputs.power, story.faults) == (False, [])


def test_a_cancel_during_the_restart_delay_only_keeps_the_power_off() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1, released 1")
    before = story.report, story.outputs
    story.event(CANCEL_1)
    assert (story.report, story.outputs) == before
    assert story.refused == []
    story.polls("charging 1")
    assert story.outputs.power is False


def test_a_second_cancel_changes_nothing() -> None:
    story = Story().polls("idle 1").event(AMR1).all([CANCEL_1, CANCEL_1]).polls("idle 4")
    story.event(CANCEL_1)
    assert story.told[-1] == (3.0, "IDLE", "")
    assert story.refused == []


def test_a_cancel_of_another_request_is_ignored() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1")
    before = story.memory
    story.event(Cancelled("req-2"))
    assert story.memory == replace(before, over=("req-2",))
    assert story.refused == [(2.0, "request not assigned here")]


def test_a_request_that_arrives_after_its_cancel_is_refused() -> None:
    story = Story().polls("idle 1").event(CANCEL_1).event(AMR1).polls("idle 1")
    assert story.refused == [(1.0, "request not assigned here"), (1.0, "request is over")]
    assert story.told == [(0.0, "IDLE", "")]


def test_a_robot_that_charges_after_its_request_has_ended_is_shown_charging_without_power() -> None:
    story = Story().polls("idle 1").event(AMR1).event(CANCEL_1).polls("idle 1, charging 3, idle 3")
    assert story.told[1:] == [
        (1.0, "ASSIGNED", "req-1"),
        (1.0, "RELEASED", "req-1"),
        (2.0, "CHARGING", "req-1"),
        (5.0, "RELEASED", "req-1"),
        (7.0, "IDLE", ""),
    ]


def test_after_a_cancel_a_lost_coupling_is_not_waited_for() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1").event(CANCEL_1)
    story.polls("handshake 3")
    assert story.told[3:] == [(2.0, "RELEASED", "req-1"), (4.0, "IDLE", "")]


def test_released_is_shown_for_its_full_time_after_the_reading_that_shows_it() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1").event(CANCEL_1)
    story.polls("silent 2, idle 3")
    assert story.told[3:] == [(4.0, "RELEASED", "req-1"), (6.0, "IDLE", "")]


# ---- CHARGER-6: faults


def test_an_error_is_shown_in_the_words_of_the_station_with_power_off() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1, hot 1")
    assert story.report == ChargerReport(
        read_at=2.0,
        state=State.CHARGER_ERROR,
        error_message="over temperature",
        request_id="req-1",
        fleet="tiny",
        robot="AMR01",
        faults=(Fault("CHARGER_ERROR", "over temperature"),),
    )
    assert story.outputs == ChargerOutputs(power=False)


def test_an_error_ends_the_request_and_the_station_becomes_idle() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1, hot 3, idle 3")
    assert story.told[3:] == [
        (2.0, "ERROR", "over temperature"),
        (5.0, "RELEASED", "req-1"),
        (7.0, "IDLE", ""),
    ]


def test_an_error_before_a_charge_ends_the_request_too() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("hot 1, idle 3")
    assert story.told[2:] == [
        (1.0, "ERROR", "over temperature"),
        (2.0, "RELEASED", "req-1"),
        (4.0, "IDLE", ""),
    ]


def test_a_ramp_down_after_an_error_is_not_another_fault() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1, hot 1, stopping 2, idle 1")
    assert story.told[3:] == [
        (2.0, "ERROR", "over temperature"),
        (3.0, "CHARGING", "req-1"),
        (5.0, "RELEASED", "req-1"),
    ]
    assert story.faults == ["CHARGER_ERROR: over temperature"]


def test_after_an_error_only_a_new_request_gives_power() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("hot 1, handshake 2")
    assert story.report is not None
    waits = "for the end of the charger's handshake: the charger was at fault before"
    assert story.report.waits == waits
    story.polls("charging 4")
    assert story.told[2:] == [
        (1.0, "ERROR", "over temperature"),
        (2.0, "ASSIGNED", "req-1"),
        (4.0, "CHARGING", "req-1"),
    ]
    assert story.outputs.power is False
    assert story.faults[-1] == "STILL_CHARGING: req-1: the charger was at fault"
    story.polls("idle 3").event(AMR2)
    assert story.outputs.power is True


def test_an_unknown_vendor_state_is_an_error_with_its_number() -> None:
    story = Story().polls("odd 1").event(Sampled(ChargerSample(Activity.UNKNOWN, 99, "?")))
    assert story.told == [
        (0.0, "ERROR", "unknown vendor state 99"),
        (1.0, "ERROR", "unknown vendor state 99: ?"),
    ]
    assert story.faults[0] == "UNKNOWN_VENDOR_STATE: unknown vendor state 99"


def test_an_error_without_a_text_names_the_number_of_the_vendor() -> None:
    story = Story().event(Sampled(ChargerSample(Activity.ERROR, 238)))
    assert story.told == [(0.0, "ERROR", "the charger reports an error (vendor state 238)")]


# ---- CHARGER-9: clearing errors


def test_errors_are_never_cleared_without_an_operator_by_default() -> None:
    assert Story().polls("hot 7200").outputs == ChargerOutputs(power=False)


def test_a_reset_of_an_operator_clears_an_error_once() -> None:
    story = Story().polls("hot 1").event(RESET)
    assert story.outputs == ChargerOutputs(power=False, clear_errors=1)
    assert story.polls("hot 60").outputs == ChargerOutputs(power=False, clear_errors=1)


def test_a_reset_with_no_error_to_clear_is_refused() -> None:
    story = Story().event(RESET).polls("idle 1").event(RESET).polls("odd 1").event(RESET)
    story.polls("hot 1, silent 3").event(RESET)
    story.polls("hot 1").event(RIVAL).event(RESET)
    assert story.refused == [
        (0.0, "the charger does not answer"),
        (1.0, "the charger reports no error to clear"),
        (2.0, "the charger reports no error to clear"),
        (6.0, "the charger does not answer"),
        (7.0, "two nodes for one device"),
    ]
    assert story.outputs.clear_errors == 0


def test_errors_are_cleared_automatically_at_the_configured_rate() -> None:
    story = Story(observed(clear_errors_per_h=4))
    cleared_at = []
    for second in range(7200):
        before = story.outputs.clear_errors
        story.polls("hot 1")
        if story.outputs.clear_errors != before:
            cleared_at.append(second)
    assert cleared_at == [0, 900, 1800, 2700, 3600, 4500, 5400, 6300]


def test_a_reset_counts_against_the_rate() -> None:
    story = Story(observed(clear_errors_per_h=1)).polls("idle 1, hot 1")
    story.now = 3000.0
    story.event(RESET)
    assert story.outputs.clear_errors == 2
    assert story.polls("hot 3600").outputs.clear_errors == 2
    assert story.polls("hot 1").outputs.clear_errors == 3


def test_an_unknown_state_is_not_cleared() -> None:
    story = Story(observed(clear_errors_per_h=60)).polls("odd 100")
    assert story.outputs.clear_errors == 0


# ---- CHARGER-7: not reachable


def test_a_station_that_was_never_read_is_in_error_with_all_outputs_off() -> None:
    story = Story().event(SILENT)
    assert story.report == ChargerReport(
        read_at=None,
        state=State.CHARGER_ERROR,
        error_message="Charger unreachable",
        faults=(Fault("CHARGER_UNREACHABLE", "192.168.1.60:80 refuses the connection"),),
    )
    assert story.outputs == ChargerOutputs(power=None)


def test_before_the_first_reading_the_error_tells_that_the_station_was_not_read() -> None:
    story = Story().event(AMR1)
    assert story.faults == ["CHARGER_UNREACHABLE: not read yet"]


def test_the_third_missed_poll_is_an_error_with_the_last_robot() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 2, silent 3")
    assert story.told[2:] == [(1.0, "CHARGING", "req-1"), (5.0, "ERROR", "Charger unreachable")]
    assert story.report == ChargerReport(
        read_at=2.0,
        state=State.CHARGER_ERROR,
        error_message="Charger unreachable",
        request_id="req-1",
        fleet="tiny",
        robot="AMR01",
        faults=(Fault("CHARGER_UNREACHABLE", "192.168.1.60:80 refuses the connection"),),
    )
    assert story.outputs == ChargerOutputs(power=None)


def test_missed_polls_count_only_when_they_follow_one_another() -> None:
    story = Story().polls("idle 1").event(AMR1)
    story.polls("silent 2, idle 1, silent 2, idle 1, silent 2")
    assert story.told[-1] == (1.0, "ASSIGNED", "req-1")


def test_a_lost_station_stays_occupied_after_its_start_timeout() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("silent 500").event(AMR2)
    assert story.refused == [(501.0, "charger in error")]
    story.polls("charging 2")
    assert story.told[2:] == [
        (3.0, "ERROR", "Charger unreachable"),
        (501.0, "CHARGING", "req-1"),
    ]


def test_a_charge_that_ended_without_a_reading_is_released_when_the_station_is_back() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1, silent 100, idle 3")
    assert story.told[3:] == [
        (4.0, "ERROR", "Charger unreachable"),
        (102.0, "RELEASED", "req-1"),
        (104.0, "IDLE", ""),
    ]


def test_a_start_timeout_that_passed_without_a_reading_is_reported_later() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("silent 100, idle 3")
    assert story.told[3:] == [(101.0, "RELEASED", "req-1"), (103.0, "IDLE", "")]
    assert story.faults[-1] == "START_TIMEOUT: tiny/AMR01 did not start to charge in time"


# ---- CHARGER-8: charges without a request


def test_a_restart_during_a_charge_adopts_the_charge_and_leaves_the_power_unchanged() -> None:
    story = Story().polls("charging 3")
    assert story.report == ChargerReport(
        read_at=2.0,
        state=State.CHARGER_CHARGING,
        faults=(Fault("UNREQUESTED_CHARGING", "nobody requested it: the robot is not known"),),
    )
    assert story.outputs == ChargerOutputs(power=None)
    story.polls("stopping 1, released 2, idle 1")
    assert story.told == [
        (0.0, "CHARGING", ""),
        (4.0, "RELEASED", ""),
        (6.0, "IDLE", ""),
    ]
    assert story.outputs == ChargerOutputs(power=False)


def test_a_charge_without_a_request_does_not_count_for_the_next_robot_that_asks() -> None:
    story = Story().polls("charging 1").event(AMR2)
    assert story.refused == [(1.0, "charger occupied")]
    assert story.report is not None
    assert story.report.robot == ""


# ---- CHARGER-10: two nodes


def test_a_second_node_for_the_same_charger_stops_everything_until_it_is_silent_for_5_s() -> None:
    story = Story().polls("idle 1").event(AMR1).polls("charging 1").event(RIVAL)
    assert story.outputs == ChargerOutputs(power=False)
    story.event(AMR2).polls("charging 3").event(RIVAL).polls("charging 6")
    assert story.told[2:] == [
        (1.0, "CHARGING", "req-1"),
        (2.0, "ERROR", "two nodes for one device"),
        (10.0, "CHARGING", "req-1"),
    ]
    assert story.refused == [(2.0, "charger in error")]
    assert story.faults == [
        "TWO_NODES_FOR_ONE_DEVICE: another node publishes this charger's states"
    ]


def test_two_nodes_for_one_charger_clear_no_error() -> None:
    story = Story(observed(clear_errors_per_h=60)).event(RIVAL).polls("hot 4")
    assert story.outputs.clear_errors == 0
    assert [fault.split(":")[0] for fault in story.faults] == [
        "TWO_NODES_FOR_ONE_DEVICE",
        "CHARGER_UNREACHABLE",
        "CHARGER_ERROR",
    ]


def test_the_core_wakes_when_the_rival_counts_as_gone() -> None:
    seen = core.decide(ChargerMemory(), RIVAL, 7.0, LIMITS)
    later = core.decide(seen.memory, IDLE, 12.0, LIMITS)
    assert (seen.wake_at, later.wake_at) == (12.0, float("inf"))


# ---- CHARGER-1: an error without a request


def test_a_station_is_free_again_after_an_error_without_a_request() -> None:
    story = Story().polls("hot 2, idle 1").event(AMR1)
    assert story.told == [
        (0.0, "ERROR", "over temperature"),
        (2.0, "IDLE", ""),
        (3.0, "ASSIGNED", "req-1"),
    ]
