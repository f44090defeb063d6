"""A station that recognises the robot on its pad, and whose power the core can switch.

The stories play the situations of a shared charger: scheduled, ad hoc, stacked, and wrong station.
`test_station_faults.py` has the faults. The stories run in virtual time, with one reading a second.
"""

import pytest
from msgspec.structs import replace

from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerDurations
from bridges.kinds.charger.signals import Activity as A
from bridges.kinds.charger.signals import (
    Cancelled,
    ChargeRequested,
    ChargerOutputs,
    ChargerSample,
    Measured,
)
from bridges.kinds.shared.decision import Fault, Sampled, WriteFailed
from bridges.messages.definitions import ChargerStateValue as State
from tests.kinds.charger.station import NOBODY, ONE, SERVING, TWO, docked, still_charging, story
from tests.kinds.charger.story import (
    AMR1,
    AMR2,
    FULL,
    RESET,
    Story,
)

# ---- CHARGER-1, CHARGER-5: a charge that was scheduled before the robot came


def test_a_scheduled_charge_names_robot_and_request_in_every_state() -> None:
    it = story().event(AMR1)
    it.sees((A.IDLE, NOBODY, 5), (A.IDLE, ONE, 1), (A.HANDSHAKE, ONE, 2), in_range=None)
    it.sees((A.CHARGING, ONE, 1), battery_percent=40.0, time_to_full_s=3600.0)
    assert it.report == ChargerReport(
        read_at=9.0,
        state=State.CHARGER_CHARGING,
        request_id="req-1",
        fleet="tiny",
        robot="AMR01",
        verified=True,
        measured=Measured(receiver_id=ONE, battery_percent=40.0, time_to_full_s=3600.0),
    )
    it.sees((A.CHARGING, ONE, 1), battery_percent=100.0, time_to_full_s=0.0)
    it.sees((A.STOPPING, ONE, 1), (A.RELEASED, ONE, 2), (A.IDLE, ONE, 5), (A.IDLE, NOBODY, 2))
    assert it.told == [
        (0.0, "IDLE", ""),
        (1.0, "ASSIGNED", "req-1"),
        (9.0, "CHARGING", "req-1"),
        (12.0, "RELEASED", "req-1"),
        (19.0, "IDLE", ""),
    ]
    assert it.faults == []


def test_power_is_on_from_the_sight_of_the_right_receiver_to_the_full_battery() -> None:
    it = story().event(AMR1)
    it.sees((A.IDLE, NOBODY, 2), (A.IDLE, ONE, 1), (A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1))
    it.sees((A.CHARGING, ONE, 1), battery_percent=100.0)
    it.sees((A.IDLE, ONE, 1))
    assert it.powered == [False, False, False, True, True, True, False, False]


def test_a_battery_is_full_at_the_configured_level() -> None:
    limits = replace(FULL, t=ChargerDurations(full_percent=80.0))
    it = story(limits).event(AMR1).sees((A.CHARGING, ONE, 1), battery_percent=79.9)
    assert it.outputs.power is True
    it.sees((A.CHARGING, ONE, 1), battery_percent=80.0)
    assert it.outputs.power is False
    assert it.faults == []


def test_a_released_station_is_not_free_before_the_pad_is_clear() -> None:
    it = docked().sees((A.IDLE, ONE, 100)).event(AMR2)
    assert it.told[-1] == (5.0, "RELEASED", "req-1")
    assert it.refused == [(105.0, "charger occupied")]
    it.sees((A.IDLE, NOBODY, 1)).event(AMR2)
    assert it.told[-2:] == [(105.0, "IDLE", ""), (106.0, "ASSIGNED", "req-2")]


def test_a_robot_on_the_pad_may_ask_again_after_released_was_shown() -> None:
    it = docked().sees((A.IDLE, ONE, 1))
    it.event(ChargeRequested("req-9", "tiny", "AMR01")).sees((A.IDLE, ONE, 2))
    it.event(ChargeRequested("req-9", "tiny", "AMR01")).sees((A.CHARGING, ONE, 1)).event(AMR1)
    assert it.told[-2:] == [(8.0, "ASSIGNED", "req-9"), (8.0, "CHARGING", "req-9")]
    assert it.refused == [(6.0, "charger occupied"), (9.0, "request is over")]


def test_a_receiver_that_is_lost_from_sight_during_a_charge_keeps_its_power() -> None:
    it = docked().sees((A.CHARGING, NOBODY, 2))
    assert it.outputs.power is True


# ---- CHARGER-5: whether the robot is in range of the pad


def test_power_waits_for_a_check_of_the_range_that_the_core_has_ordered() -> None:
    it = story().event(AMR1).sees((A.IDLE, NOBODY, 1), in_range=True)
    assert it.outputs == ChargerOutputs(power=False)
    it.sees((A.IDLE, ONE, 1), in_range=True)  # this result is older than the core's order to check
    assert it.outputs == ChargerOutputs(power=False, range_checks=1)
    it.sees((A.IDLE, ONE, 1), in_range=False)
    assert it.outputs == ChargerOutputs(power=False, range_checks=1)
    it.sees((A.IDLE, ONE, 1), in_range=True)
    assert it.outputs == ChargerOutputs(power=True, range_checks=1)


@pytest.mark.parametrize("there", [NOBODY, TWO])
def test_a_robot_that_comes_back_to_the_pad_needs_a_new_check_of_the_range(there: str) -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 2), in_range=True)
    assert it.outputs == ChargerOutputs(power=True, range_checks=1)
    it.sees((A.IDLE, there, 1), in_range=True).sees((A.IDLE, ONE, 1), in_range=True)
    assert it.outputs == ChargerOutputs(power=False, range_checks=1)
    it.sees((A.IDLE, ONE, 3), in_range=True)  # 5 s after the last check
    assert it.outputs == ChargerOutputs(power=True, range_checks=2)


def test_after_a_silence_of_the_station_the_range_is_checked_again() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 2), in_range=True).polls("silent 4")
    it.sees((A.IDLE, ONE, 1), in_range=True)
    assert it.outputs == ChargerOutputs(power=False, range_checks=2)


def test_a_check_of_the_range_that_was_not_written_proves_nothing() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 1), in_range=True)
    it.event(WriteFailed("no reply")).sees((A.IDLE, ONE, 4), in_range=True)
    assert it.outputs == ChargerOutputs(power=False, range_checks=1)
    it.sees((A.IDLE, ONE, 2), in_range=True)
    assert it.outputs == ChargerOutputs(power=True, range_checks=2)


def test_errors_whose_clearing_was_not_written_stay_until_the_next_reset() -> None:
    fan = Sampled(ChargerSample(A.ERROR, 9, "fan", side="station"))
    it = story().event(fan).event(RESET).event(WriteFailed("no reply"))
    it.sees((A.IDLE, NOBODY, 3))
    assert it.told[-1][1:] == ("ERROR", "out of service after: station: fan")
    it.event(RESET).sees((A.IDLE, NOBODY, 1))
    assert it.told[-1][1] == "IDLE"


def test_the_range_is_checked_every_five_seconds_until_the_start_timeout() -> None:
    it = story().event(AMR1)
    asked = []
    for _ in range(70):
        before = it.outputs.range_checks
        it.sees((A.IDLE, ONE, 1), in_range=False)
        if it.outputs.range_checks > before:
            asked.append(it.now - 1.0)
    assert asked == [1.0 + 5.0 * n for n in range(12)]
    assert it.told[-1] == (61.0, "RELEASED", "req-1")
    assert True not in it.powered


def test_a_range_that_is_lost_during_a_charge_changes_nothing() -> None:
    it = docked().sees((A.CHARGING, ONE, 1), in_range=False)
    assert it.outputs == ChargerOutputs(power=True)


def test_a_coupling_that_is_sought_again_needs_a_new_check_of_the_range() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 2), in_range=True)
    it.sees((A.CHARGING, ONE, 1), in_range=True).sees((A.HANDSHAKE, ONE, 1), in_range=True)
    assert it.outputs == ChargerOutputs(power=False, range_checks=2)
    it.sees((A.HANDSHAKE, ONE, 1), in_range=True)
    assert it.outputs == ChargerOutputs(power=True, range_checks=2)


# ---- CHARGER-2, CHARGER-3: a charge ad hoc, for a robot that is on the pad already


def test_a_robot_already_on_the_pad_is_charged_when_it_asks() -> None:
    it = story().sees((A.IDLE, ONE, 2)).event(AMR1).sees((A.IDLE, ONE, 1), (A.CHARGING, ONE, 1))
    assert it.told == [
        (0.0, "IDLE", ""),
        (1.0, "ERROR", "wrong docking: tiny/AMR01 is not assigned here"),
        (3.0, "ASSIGNED", "req-1"),
        (4.0, "CHARGING", "req-1"),
    ]
    assert it.powered == [False, False, False, True, True]


def test_the_start_timeout_of_an_ad_hoc_request_counts_from_its_acceptance() -> None:
    asked = ChargeRequested("req-1", "tiny", "AMR01", start_timeout_s=5.0)
    it = story().sees((A.IDLE, ONE, 10)).event(asked).sees((A.IDLE, ONE, 6))
    assert it.told[-1] == (16.0, "RELEASED", "req-1")
    assert it.faults[-1] == "START_TIMEOUT: tiny/AMR01 did not start to charge in time"


def test_a_charge_that_breaks_off_again_and_again_ends_at_the_start_timeout() -> None:
    it = story().event(AMR1).sees((A.HANDSHAKE, ONE, 1))  # the start timeout is 60 s
    for _ in range(5):
        it.sees((A.CHARGING, ONE, 1), (A.HANDSHAKE, ONE, 10))
    assert it.told[-1][1] == "ASSIGNED"
    it.sees((A.CHARGING, ONE, 1), (A.HANDSHAKE, ONE, 10))
    assert it.told[-1][1:] == ("RELEASED", "req-1")
    assert it.faults == ["START_TIMEOUT: tiny/AMR01 did not start to charge in time"]


def test_after_a_long_charge_a_robot_that_is_sought_again_has_the_whole_start_timeout() -> None:
    it = story().event(AMR1).sees((A.HANDSHAKE, ONE, 50), (A.CHARGING, ONE, 60))
    it.sees((A.HANDSHAKE, ONE, 60))
    assert it.told[-1][1] == "ASSIGNED"
    assert it.sees((A.HANDSHAKE, ONE, 1)).told[-1][1] == "RELEASED"


def test_with_the_setting_a_known_robot_is_charged_without_a_request() -> None:
    serves = replace(FULL, unrequested="serve_known")
    it = story(serves).sees((A.IDLE, ONE, 1), (A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 2))
    it.sees((A.IDLE, ONE, 5), (A.IDLE, NOBODY, 2))
    assert [(at, state) for at, state, _ in it.told] == [
        (0.0, "IDLE"),
        (1.0, "ASSIGNED"),
        (3.0, "CHARGING"),
        (5.0, "RELEASED"),
        (10.0, "IDLE"),
    ]
    assert it.powered == [False, True, True, True, True] + [False] * 7


def test_a_robot_served_without_a_request_may_send_request_and_cancel_and_may_leave() -> None:
    serves = replace(FULL, unrequested="serve_known")
    asks = story(serves).sees((A.IDLE, ONE, 1)).event(AMR2).event(AMR1)
    assert (asks.told[-1], asks.refused) == (
        (2.0, "ASSIGNED", "req-1"),
        [(2.0, "charger occupied")],
    )
    late = asks.sees((A.IDLE, ONE, 61))
    assert late.told[-1] == (62.0, "RELEASED", "req-1")
    cancelled = story(serves).sees((A.CHARGING, ONE, 1)).event(Cancelled(""))
    assert (cancelled.outputs.power, cancelled.refused) == (False, [])
    left = story(serves).sees((A.IDLE, ONE, 1), (A.IDLE, NOBODY, 3))
    assert left.told[-1] == (4.0, "IDLE", "")


def test_a_station_at_fault_or_a_stranger_is_not_served_without_a_request() -> None:
    serves = replace(FULL, unrequested="serve_known")
    it = story(serves).sees((A.ERROR, ONE, 1), (A.IDLE, ONE, 1), (A.IDLE, "rx-9", 1))
    assert it.powered == [False] * 4
    assert it.memory.holder is None


def test_a_robot_served_without_a_request_gets_no_more_power_after_it_has_left() -> None:
    it = story(SERVING).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1), (A.IDLE, NOBODY, 1))
    it.sees((A.CHARGING, ONE, 4))
    assert it.powered == [False, True, True, *[False] * 5]
    assert still_charging(it) == ["STILL_CHARGING: tiny/AMR01: left"]


def test_robots_served_without_a_request_push_no_ended_request_out_of_memory() -> None:
    it = story(SERVING).event(AMR1).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1))
    for _ in range(9):
        it.sees((A.IDLE, NOBODY, 5), (A.HANDSHAKE, TWO, 1), (A.CHARGING, TWO, 1))
    it.sees((A.IDLE, NOBODY, 5)).event(AMR1)
    assert it.refused == [(it.now, "request is over")]


# ---- CHARGER-2: stacked robots, of which the second waits for the first


def test_a_second_robot_is_not_granted_until_the_first_has_left_the_pad() -> None:
    it = docked().event(AMR2).sees((A.CHARGING, ONE, 1), (A.IDLE, ONE, 5)).event(AMR2)
    assert it.refused == [(5.0, "charger occupied"), (11.0, "charger occupied")]
    assert it.report is not None
    assert (it.report.request_id, it.report.robot) == ("req-1", "AMR01")


def test_the_second_robot_is_not_charged_when_it_arrives_first() -> None:
    it = story().event(AMR1).sees((A.IDLE, TWO, 3), (A.HANDSHAKE, TWO, 1))
    assert it.told[1:] == [
        (1.0, "ASSIGNED", "req-1"),
        (1.0, "ERROR", "wrong docking: tiny/AMR02 stands here, tiny/AMR01 is expected"),
    ]
    assert it.powered == [False] * 5
    assert it.report is not None
    assert (it.report.request_id, it.report.robot, it.report.verified) == ("req-1", "AMR01", False)


# ---- CHARGER-5: wrong station


def test_a_robot_at_the_wrong_station_is_refused_and_named_until_it_leaves() -> None:
    it = story().sees((A.IDLE, ONE, 2), (A.HANDSHAKE, ONE, 2))
    assert it.report == ChargerReport(
        read_at=4.0,
        state=State.CHARGER_ERROR,
        error_message="wrong docking: tiny/AMR01 is not assigned here",
        fleet="tiny",
        robot="AMR01",
        verified=True,
        faults=(Fault("WRONG_DOCKING", "wrong docking: tiny/AMR01 is not assigned here"),),
        measured=Measured(receiver_id=ONE),
    )
    it.event(AMR2)
    assert it.refused == [(5.0, "charger in error")]
    it.sees((A.IDLE, NOBODY, 1))
    assert it.told[-1] == (5.0, "IDLE", "")
    assert it.powered == [False] * 6


def test_the_right_station_stays_assigned_until_its_start_timeout() -> None:
    it = story().event(AMR1).sees((A.IDLE, NOBODY, 65))
    assert it.told[1:] == [
        (1.0, "ASSIGNED", "req-1"),
        (61.0, "RELEASED", "req-1"),
        (63.0, "IDLE", ""),
    ]


def test_a_wrong_robot_on_the_pad_pauses_the_start_timeout() -> None:
    it = story().event(AMR1)
    it.sees((A.IDLE, NOBODY, 10), (A.IDLE, TWO, 100), (A.IDLE, NOBODY, 55))
    assert it.told[2:] == [
        (11.0, "ERROR", "wrong docking: tiny/AMR02 stands here, tiny/AMR01 is expected"),
        (111.0, "ASSIGNED", "req-1"),
        (161.0, "RELEASED", "req-1"),
        (163.0, "IDLE", ""),
    ]
    assert it.report is not None
    right = story().event(AMR1).sees((A.IDLE, TWO, 100), (A.IDLE, ONE, 1), (A.CHARGING, ONE, 1))
    assert right.told[-1] == (102.0, "CHARGING", "req-1")


def test_an_unknown_receiver_is_refused_with_its_number() -> None:
    it = story().sees((A.IDLE, "4711", 1)).sees((A.IDLE, NOBODY, 1)).event(AMR1)
    it.sees((A.HANDSHAKE, "4711", 1))
    assert it.told[1:] == [
        (1.0, "ERROR", "unknown receiver 4711"),
        (2.0, "IDLE", ""),
        (3.0, "ASSIGNED", "req-1"),
        (3.0, "ERROR", "unknown receiver 4711, tiny/AMR01 is expected"),
    ]


def test_a_robot_that_replaces_the_first_robot_on_the_pad_is_refused() -> None:
    it = docked().sees((A.CHARGING, TWO, 3), (A.IDLE, TWO, 3), (A.IDLE, NOBODY, 1))
    assert it.powered[5:] == [False] * 7
    assert it.told[3:] == [
        (5.0, "ERROR", "wrong docking: tiny/AMR02 is not assigned here"),
        (11.0, "IDLE", ""),
    ]


def test_a_robot_without_a_receiver_here_is_not_granted() -> None:
    it = story().event(ChargeRequested("req-7", "tiny", "AMR07"))
    assert it.refused == [(1.0, "robot has no receiver here")]


def test_a_station_that_names_no_receiver_charges_nobody_if_the_yaml_has_receivers() -> None:
    it = Story(FULL).polls("idle 1").event(AMR1).polls("charging 1")
    assert it.told == [
        (0.0, "ERROR", "the YAML has receivers, but the charger does not say which one it sees")
    ]
    assert it.outputs.power is False


def test_an_unknown_receiver_pauses_the_start_timeout_and_ends_a_charge() -> None:
    waits = story().event(AMR1).sees((A.IDLE, "4711", 100), (A.IDLE, NOBODY, 1))
    assert waits.told[-1] == (101.0, "ASSIGNED", "req-1")
    charged = docked().sees((A.CHARGING, "4711", 4), (A.IDLE, NOBODY, 1))
    assert charged.told[-1] == (9.0, "IDLE", "")


def test_a_displaced_robot_gets_no_more_power_for_its_request() -> None:
    it = (
        story().event(AMR1).sees((A.HANDSHAKE, ONE, 1), (A.CHARGING, ONE, 1), (A.HANDSHAKE, TWO, 1))
    )
    it.sees((A.CHARGING, ONE, 4))
    assert it.powered == [False, True, True, *[False] * 5]
    assert still_charging(it) == ["STILL_CHARGING: req-1: left"]


def test_a_robot_that_left_full_counts_as_full_after_another_robot_came() -> None:
    it = (
        story()
        .event(AMR1)
        .sees((A.HANDSHAKE, ONE, 1))
        .sees((A.CHARGING, ONE, 1), battery_percent=100.0)
    )
    it.sees((A.HANDSHAKE, TWO, 1), (A.CHARGING, ONE, 1))
    assert it.powered == [False, True, False, False, False]
    assert still_charging(it) == []


def test_each_refusal_has_its_own_fault() -> None:
    stranger = story().sees((A.IDLE, "4711", 1))
    other = story().event(AMR1).sees((A.IDLE, TWO, 1))
    mute = Story(FULL).polls("idle 1")
    assert [it.faults[-1].partition(":")[0] for it in (stranger, other, mute)] == [
        "UNKNOWN_RECEIVER",
        "WRONG_DOCKING",
        "RECEIVER_NOT_TOLD",
    ]


# ---- CHARGER-5: a station that moves its pad


def test_nothing_is_energised_before_the_pad_is_at_its_height_and_the_robot_in_range() -> None:
    it = story().event(AMR1)
    for height, ok in ((False, False), (True, False), (False, True), (True, True)):
        it.sees((A.IDLE, ONE, 1), at_height=height, range_ok=ok)
    assert it.powered[1:] == [False, False, False, True]


def test_a_station_without_pad_signals_needs_no_pad() -> None:
    assert story().event(AMR1).sees((A.IDLE, ONE, 1)).powered[1:] == [True]


def test_a_pad_that_leaves_its_height_under_power_is_a_fault_of_the_station() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 1), (A.CHARGING, ONE, 2), at_height=True)
    it.sees((A.CHARGING, ONE, 1), at_height=False)
    assert it.powered[1:] == [True, True, True, False]
    error = "station: the pad left its height under power"
    assert it.told[-1] == (4.0, "ERROR", error)
    it.sees((A.IDLE, ONE, 2), at_height=True)
    assert it.told[-1] == (5.0, "ERROR", f"out of service after: {error}")
    it.event(RESET).sees((A.IDLE, NOBODY, 3), at_height=False)
    assert it.told[-1][1:] == ("IDLE", "")
    assert True not in it.powered[4:]


def test_a_pad_that_sinks_when_no_current_flows_is_not_a_fault() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 1), (A.CHARGING, ONE, 1), at_height=True)
    it.sees((A.STOPPING, ONE, 1), (A.IDLE, NOBODY, 4), at_height=False)
    assert it.powered[1:] == [True, True, False, False, False, False, False]
    assert [line[1] for line in it.told[1:]] == ["ASSIGNED", "CHARGING", "RELEASED", "IDLE"]


def test_no_check_of_the_range_is_ordered_for_a_pad_that_is_down() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 3), at_height=False, in_range=False)
    assert it.outputs.range_checks == 0
    assert it.sees((A.IDLE, ONE, 1), at_height=True, in_range=False).outputs.range_checks == 1


def test_a_range_that_is_lost_under_power_ends_the_power_without_a_fault() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 1), (A.CHARGING, ONE, 1), range_ok=True)
    it.sees((A.CHARGING, ONE, 1), (A.IDLE, ONE, 1), range_ok=False)
    assert it.powered[1:] == [True, True, False, False]
    assert it.told[-1][1:] == ("RELEASED", "req-1")
    assert it.faults == []


def test_a_start_timeout_says_that_the_pad_never_rose() -> None:
    it = story().event(AMR1).sees((A.IDLE, ONE, 62), at_height=False)
    late = "START_TIMEOUT: tiny/AMR01 did not start to charge in time"
    assert it.faults == [f"{late}: the pad is not at its height"]


def test_a_station_that_can_only_be_observed_shows_a_lost_height_while_it_lasts() -> None:
    it = Story()
    for height in (True, False, True):
        known = Measured(at_height=height)
        it.event(Sampled(ChargerSample(A.CHARGING, 5, measured=known)))
    error = "station: the pad left its height under power"
    assert [line[1:] for line in it.told] == [
        ("CHARGING", ""),
        ("ERROR", error),
        ("CHARGING", ""),
    ]
