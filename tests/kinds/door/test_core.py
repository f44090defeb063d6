"""The door's core, rule by rule, in virtual time."""

import math

import pytest
from msgspec.structs import replace

from bridges.kinds.door.core import repeated
from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.report import DoorReport
from bridges.kinds.door.settings import DoorDurations, DoorSettings, Pulse
from bridges.kinds.door.signals import DoorOutputs, DoorSample, Event
from bridges.kinds.shared.decision import (
    AlarmInputs,
    Fault,
    IoFailed,
    OperatorReset,
    RivalSeen,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.kinds.shared.durations import RIVAL_QUIET_S
from bridges.messages.definitions import DoorModeValue
from tests.kinds.door.virtual import (
    BETWEEN,
    BOTH,
    CLOSED,
    CLOSES,
    DEBOUNCED,
    OPEN,
    OPENS,
    STALE_S,
    CoreAlone,
    limits,
)

ESTIMATED = DoorLimits(t=DoorDurations(open_delay_s=4.0, travel_s=6.0), estimated=True)


def test_the_limits_are_those_of_the_file() -> None:
    t, pulse, debounce = (
        DoorDurations(open_delay_s=4.0),
        Pulse(on_s=0.5, every_s=8.0),
        {"opened": 0.1},
    )
    settings = DoorSettings(limits=t, feedback="estimated", on_fire="open", pulse=pulse)
    assert DoorLimits.of(settings, debounce) == DoorLimits(t, debounce, True, "open", pulse)
    assert DoorLimits.of(DoorSettings(), {}) == DoorLimits()


# ---- DOOR-5: a door without a fresh reading


def test_before_the_first_reading_a_door_is_offline_and_nothing_is_held() -> None:
    core = CoreAlone()
    decided = core.hears(IoFailed("connection refused"))
    assert decided.report == DoorReport(
        mode=DoorModeValue.MODE_OFFLINE,
        read_at=None,
        faults=(Fault("COMMUNICATION_LOST", "connection refused"),),
    )
    assert core.hears(OPENS).outputs == DoorOutputs(hold_open=False)
    assert decided.wake_at == math.inf


def test_an_open_before_the_first_reading_takes_effect_with_that_reading() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.now = 1.0
    core.sees(CLOSED, until=1.1)
    assert core.told == [(0.0, "OFFLINE", False), (1.0, "UNKNOWN", True), (1.0625, "CLOSED", True)]


# ---- DOOR-6: the contacts


def test_a_doors_position_is_unknown_before_its_contacts_have_settled() -> None:
    core = CoreAlone()
    core.sees(OPEN, until=0.3)
    assert core.told == [(0.0, "UNKNOWN", False), (0.0625, "OPEN", False)]


# ---- DOOR-1: OPEN, CLOSE and the grace (the delay between CLOSE and the release of the door)


def test_an_open_request_holds_the_door_and_its_contacts_show_its_position() -> None:
    core = CoreAlone()
    core.sees(CLOSED, until=1.0)
    core.hears(OPENS)
    core.sees(BETWEEN, until=3.0)
    core.sees(OPEN, until=4.0)
    assert core.told == [
        (0.0, "UNKNOWN", False),
        (0.0625, "CLOSED", False),
        (1.0, "CLOSED", True),
        (1.0625, "MOVING", True),
        (3.0625, "OPEN", True),
    ]


def test_a_thousand_open_requests_switch_the_relay_once() -> None:
    once, often = CoreAlone(), CoreAlone()
    for core, times in ((once, 1), (often, 1000)):
        core.sees(CLOSED, until=1.0)
        for _ in range(times):
            core.hears(OPENS)
        core.sees(OPEN, until=2.0)
    assert often.told == once.told
    assert often.memory == once.memory


def test_repeats_of_close_do_not_prolong_the_grace() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    for second in range(6):
        core.sees(OPEN, until=second + 1.0)
        core.hears(CLOSES)
    assert core.told[-2:] == [(0.0625, "OPEN", True), (4.0, "OPEN", False)]


def test_an_open_within_the_grace_cancels_the_close() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    core.hears(CLOSES)
    core.sees(OPEN, until=3.875)
    core.hears(OPENS)
    core.sees(OPEN, until=600.0)
    assert core.told[-1] == (0.0625, "OPEN", True)


def test_the_next_close_begins_a_new_grace() -> None:
    core = CoreAlone(limits(close_grace_s=2.0))
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    core.hears(CLOSES)
    core.sees(OPEN, until=2.5)
    core.hears(OPENS)
    core.hears(CLOSES)
    core.sees(OPEN, until=10.0)
    assert core.told[-1] == (4.5, "OPEN", False)


def test_without_grace_a_close_request_releases_the_hold_at_once() -> None:
    core = CoreAlone(limits(close_grace_s=0.0))
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    assert core.hears(CLOSES).outputs == DoorOutputs(hold_open=False)


# ---- DOOR-3: obstructions


def test_an_obstruction_holds_the_door_again_and_one_second_longer() -> None:
    core = CoreAlone(limits(close_grace_s=1.0))
    clear = replace(OPEN, obstruction=False)
    core.hears(OPENS)
    core.sees(clear, until=1.0)
    core.hears(CLOSES)
    core.sees(clear, until=2.5)
    core.sees(replace(BETWEEN, obstruction=True), until=4.0)
    assert core.faults() == (
        "DOOR_OBSTRUCTED: held open after CLOSE while the doorway is not clear",
    )
    core.sees(clear, until=6.0)
    core.sees(replace(BETWEEN, obstruction=False), until=7.0)
    core.sees(replace(CLOSED, obstruction=False), until=8.0)
    core.sees(replace(CLOSED, obstruction=True), until=9.0)
    assert core.told[1:] == [
        (0.0, "UNKNOWN", True),
        (0.0625, "OPEN", True),
        (2.0, "OPEN", False),
        (2.5625, "MOVING", True),
        (4.0625, "OPEN", True),
        (5.0, "OPEN", False),
        (6.0625, "MOVING", False),
        (7.0625, "CLOSED", False),
    ]


def test_an_obstruction_at_an_idle_door_does_not_open_it() -> None:
    core = CoreAlone()
    core.sees(replace(CLOSED, obstruction=True), until=10.0)
    core.sees(replace(OPEN, obstruction=True), until=20.0)
    assert [hold for _, _, hold in core.told] == [False, False, False]


def test_an_obstruction_also_holds_the_door_after_a_hold_that_ended_at_once() -> None:
    core = CoreAlone(limits(close_grace_s=0.0))
    core.sees(replace(OPEN, obstruction=False), until=1.0)
    core.hears(OPENS)
    core.hears(CLOSES)
    core.sees(replace(BETWEEN, obstruction=True), until=2.0)
    assert core.told[-3:] == [(1.0, "OPEN", True), (1.0, "OPEN", False), (1.0625, "MOVING", True)]


def test_an_obstruction_at_a_door_that_is_not_held_is_not_a_fault() -> None:
    core = CoreAlone()
    core.sees(replace(OPEN, obstruction=True), until=1.0)
    assert core.faults() == ()


# ---- DOOR-6, DOOR-SENSING-4: the reported position


def test_a_door_that_reads_open_and_closed_together_is_unknown_and_a_fault() -> None:
    core = CoreAlone()
    core.sees(BOTH, until=1.0)
    assert core.faults() == ("DOOR_CONTACTS_CONTRADICT: the door reads open and closed",)
    core.sees(CLOSED, until=2.0)
    assert core.told == [(0.0, "UNKNOWN", False), (1.0625, "CLOSED", False)]
    assert core.faults() == ()


def test_a_door_between_its_limits_for_too_long_is_unknown() -> None:
    core = CoreAlone(limits(travel_s=5.0))
    core.sees(CLOSED, until=1.0)
    core.sees(BETWEEN, until=10.0)
    assert core.told[1:] == [
        (0.0625, "CLOSED", False),
        (1.0625, "MOVING", False),
        (6.0625, "UNKNOWN", False),
    ]
    assert core.faults() == ("DOOR_TRAVEL_TIMEOUT: between its end positions for 5.0 s",)
    core.sees(OPEN, until=11.0)
    assert (core.told[-1], core.faults()) == ((10.0625, "OPEN", False), ())


def test_a_door_that_reverses_gets_its_whole_travel_time_again() -> None:
    core = CoreAlone(limits(travel_s=5.0))
    core.sees(CLOSED, until=1.0)
    core.sees(BETWEEN, until=4.0)
    core.hears(OPENS)
    core.sees(BETWEEN, until=10.0)
    assert core.told[2:] == [
        (1.0625, "MOVING", False),
        (4.0, "MOVING", True),
        (9.0, "UNKNOWN", True),
    ]


def test_a_door_without_a_position_from_its_controller_is_unknown() -> None:
    core = CoreAlone()
    core.sees(OPEN, until=1.0)
    core.sees(replace(OPEN, lost="status 7 is not listed"), until=2.0)
    assert core.faults() == ("DOOR_POSITION_UNKNOWN: status 7 is not listed",)
    core.sees(OPEN, until=3.0)
    assert core.faults() == ()
    assert core.told == [
        (0.0, "UNKNOWN", False),
        (0.0625, "OPEN", False),
        (1.0, "UNKNOWN", False),
        (2.0, "OPEN", False),
    ]


def test_a_door_that_does_not_open_has_a_fault_and_stays_held() -> None:
    core = CoreAlone(limits(open_timeout_s=4.0))
    core.sees(CLOSED, until=1.0)
    core.hears(OPENS)
    core.sees(CLOSED, until=4.875)
    core.hears(OPENS)
    assert core.faults() == ()
    core.sees(CLOSED, until=6.0)
    assert core.faults() == ("DOOR_OPENING_FAULT: held, but not open after 4.0 s",)
    assert core.told[-1] == (1.0, "CLOSED", True)
    core.hears(OperatorReset())
    assert core.faults() == ("DOOR_OPENING_FAULT: held, but not open after 4.0 s",)
    core.sees(OPEN, until=7.0)
    assert core.faults() == ()


# ---- DOOR-7: a second node of the same name


def test_a_rival_takes_the_door_offline_until_it_is_silent_for_five_seconds() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    core.hears(RivalSeen())
    core.sees(OPEN, until=3.0)
    core.hears(RivalSeen())
    assert core.faults() == (
        "TWO_NODES_FOR_ONE_DEVICE: another node publishes states of this door",
    )
    core.sees(OPEN, until=20.0)
    assert core.told[2:] == [
        (0.0625, "OPEN", True),
        (1.0, "OFFLINE", False),
        (8.0, "OPEN", True),
    ]


def test_the_core_wakes_when_another_node_has_been_silent_for_long_enough() -> None:
    assert CoreAlone().hears(RivalSeen()).wake_at == RIVAL_QUIET_S


# ---- DOOR-4: fire


def test_a_fire_releases_the_door_forgets_the_request_and_refuses_to_open() -> None:
    core = CoreAlone()
    quiet, fire = replace(OPEN, fire=False), replace(OPEN, fire=True)
    core.hears(OPENS)
    core.sees(quiet, until=1.0)
    core.sees(fire, until=2.0)
    assert core.faults() == ("FIRE_ALARM: the door is released",)
    assert core.hears(OPENS).refused == "the fire alarm has released the door"
    core.sees(quiet, until=4.0)
    assert core.hears(OPENS).refused == ""
    assert core.told[2:] == [
        (0.0625, "OPEN", True),
        (1.0625, "UNKNOWN", False),
        (3.0, "OPEN", False),
        (4.0, "OPEN", True),
    ]


@pytest.mark.parametrize(
    "event",
    [
        Sampled(OPEN),
        Suspended("slept"),
        WriteFailed("no reply"),
        IoFailed("no reply"),
        RivalSeen(),
        OPENS,
        CLOSES,
        OperatorReset(),
    ],
)
def test_no_event_is_refused_without_a_fire(event: Event) -> None:
    core = CoreAlone()
    core.hears(OPENS)
    assert core.hears(event).refused == ""


def test_a_fire_holds_open_against_close_where_the_site_says_so() -> None:
    core = CoreAlone(DoorLimits(debounce=DEBOUNCED, on_fire="open"))
    core.sees(replace(CLOSED, fire=False), until=1.0)
    core.sees(replace(CLOSED, fire=True), until=2.0)
    core.sees(replace(OPEN, fire=True), until=3.0)
    core.hears(CLOSES)
    core.sees(replace(OPEN, fire=True), until=10.0)
    assert core.faults() == ("FIRE_ALARM: the door is held open",)
    core.sees(replace(OPEN, fire=False), until=12.0)
    assert core.told[1:] == [
        (0.0625, "CLOSED", False),
        (1.0625, "CLOSED", True),
        (2.0625, "OPEN", True),
        (11.0, "OPEN", False),
    ]


def test_the_first_reading_of_a_fire_already_forbids_the_hold() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(replace(OPEN, fire=True), until=1.0)
    assert core.told == [(0.0, "OFFLINE", False), (0.0, "UNKNOWN", False)]


def test_only_a_fire_lets_a_fire_door_close_on_an_obstruction() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(replace(OPEN, fire=False, obstruction=False), until=1.0)
    core.sees(replace(OPEN, fire=True, obstruction=True), until=3.0)
    assert core.told[-1] == (1.0625, "UNKNOWN", False)


# ---- DOOR-1: a hold by pulses


def test_an_operator_that_closes_by_itself_is_triggered_at_a_steady_pace() -> None:
    core = CoreAlone(DoorLimits(debounce=DEBOUNCED, pulse=Pulse(on_s=0.5, every_s=3.0)))
    core.sees(CLOSED, until=1.0)
    for second in range(6):
        core.hears(OPENS)
        core.sees(OPEN, until=second + 2.0)
    core.hears(CLOSES)
    core.sees(OPEN, until=14.0)
    assert [(at, hold) for at, _, hold in core.told if at > 1.0625] == [
        (1.5, False),
        (4.0, True),
        (4.5, False),
        (7.0, True),
        (7.5, False),
    ]
    assert core.last is not None
    assert core.last.report.hold is False


def test_between_two_pulses_the_door_is_still_held() -> None:
    core = CoreAlone(DoorLimits(debounce=DEBOUNCED, pulse=Pulse(on_s=0.5, every_s=3.0)))
    core.hears(OPENS)
    decided = core.sees(OPEN, until=2.0)
    assert (decided.outputs, decided.report.hold) == (DoorOutputs(between_pulses=True), True)


def test_the_core_wakes_at_the_edges_of_each_pulse() -> None:
    core = CoreAlone(
        DoorLimits(t=DoorDurations(stale_after_s=9.0), pulse=Pulse(on_s=0.5, every_s=3.0))
    )
    core.hears(OPENS)
    core.hears(Sampled(OPEN))
    wakes = []
    for _ in range(4):
        assert core.last is not None
        core.now = core.last.wake_at
        core.hears(OPENS)
        wakes.append(core.now)
    assert wakes == [0.5, 3.0, 3.5, 6.0]


# ---- DOOR-SENSING-3: estimates


def test_without_contacts_the_position_is_estimated_from_the_travel_time_and_marked() -> None:
    core = CoreAlone(DoorLimits(t=DoorDurations(open_delay_s=4.0, travel_s=6.0), estimated=True))
    core.sees(DoorSample(), until=10.0)
    core.hears(OPENS)
    opened = core.sees(DoorSample(), until=15.0)
    core.hears(CLOSES)
    core.sees(DoorSample(), until=30.0)
    assert core.told == [
        (0.0, "MOVING", False),
        (6.0, "CLOSED", False),
        (10.0, "MOVING", True),
        (14.0, "OPEN", True),
        (18.0, "MOVING", False),
        (24.0, "CLOSED", False),
    ]
    assert (opened.report.estimated, opened.report.faults) == (True, ())


def test_an_estimate_begins_again_after_a_failed_reading() -> None:
    core = CoreAlone(DoorLimits(t=DoorDurations(open_delay_s=4.0), estimated=True))
    core.hears(OPENS)
    core.sees(DoorSample(), until=5.0)
    core.sees(IoFailed("no reply"), until=5.5)
    core.sees(DoorSample(), until=20.0)
    core.sees(IoFailed("no reply"), until=25.0)
    assert core.told[1:] == [
        (0.0, "MOVING", True),
        (4.0, "OPEN", True),
        (5.0, "MOVING", True),
        (9.5, "OPEN", True),
        (20.0, "MOVING", True),
        (21.0, "OFFLINE", False),
    ]


def test_outputs_that_cannot_be_written_make_the_door_offline_until_a_write_succeeds() -> None:
    """The relay may be off although the door is open, so no robot may rely on the hold."""
    core = CoreAlone()
    core.sees(OPEN, until=1.0)
    core.hears(OPENS)
    for half_seconds in range(5):
        core.now = 1.0 + half_seconds / 2
        core.hears(Sampled(OPEN))
        core.hears(WriteFailed("exception 4"))
    assert core.told[-1] == (2.0, "OFFLINE", True)
    assert core.faults() == ("OUTPUTS_NOT_WRITTEN: exception 4",)
    assert core.last is not None
    assert core.last.report.waits == "for its outputs to be written"
    core.now = 3.5
    core.hears(Sampled(OPEN))
    assert core.faults() == ("OUTPUTS_NOT_WRITTEN: exception 4",)
    core.now = 4.0
    core.hears(Sampled(OPEN))
    assert (core.told[-1], core.faults()) == ((4.0, "OPEN", True), ())


def test_the_core_wakes_when_unwritten_outputs_become_a_fault() -> None:
    core = CoreAlone()
    core.sees(OPEN, until=1.0)
    core.hears(WriteFailed("exception 4"))
    core.now = 1.5
    assert core.hears(Sampled(OPEN)).wake_at == 1.0 + STALE_S
    assert core.faults() == ()


def test_a_fire_does_not_say_that_a_relay_is_off_that_was_not_written() -> None:
    core = CoreAlone()
    core.sees(replace(OPEN, fire=False), until=1.0)
    core.hears(WriteFailed("exception 4"))
    core.sees(replace(OPEN, fire=True), until=2.0)
    assert "FIRE_ALARM: the door is released" in core.faults()
    core.hears(WriteFailed("exception 4"))
    assert "FIRE_ALARM: the door must be released" in core.faults()


def test_a_failed_write_leaves_the_reading_and_starts_the_estimate_again() -> None:
    core = CoreAlone(ESTIMATED)
    core.hears(OPENS)
    core.sees(DoorSample(), until=5.0)
    core.hears(WriteFailed("no reply"))
    core.sees(DoorSample(), until=10.0)
    assert core.told == [
        (0.0, "OFFLINE", False),
        (0.0, "MOVING", True),
        (4.0, "OPEN", True),
        (5.0, "MOVING", True),
        (9.0, "OPEN", True),
    ]


def test_the_core_wakes_when_an_estimated_door_has_arrived_and_then_for_its_next_reading() -> None:
    core = CoreAlone(replace(ESTIMATED, t=replace(ESTIMATED.t, stale_after_s=20.0)))
    assert core.hears(Sampled(DoorSample())).wake_at == 6.0
    assert core.hears(OPENS).wake_at == 4.0
    core.now = 4.0
    assert core.hears(OPENS).wake_at == 20.0


def test_the_core_wakes_when_a_door_that_was_not_read_for_a_while_is_estimated_closed() -> None:
    core = CoreAlone(replace(ESTIMATED, t=replace(ESTIMATED.t, stale_after_s=20.0)))
    core.hears(Sampled(DoorSample()))
    core.hears(IoFailed("no reply"))
    core.now = 2.0
    core.hears(Sampled(DoorSample()))
    core.now = 6.0
    assert core.hears(Sampled(DoorSample())).wake_at == 8.0


def test_without_open_delay_s_a_door_is_never_estimated_open() -> None:
    core = CoreAlone(DoorLimits(estimated=True))
    core.hears(OPENS)
    core.sees(DoorSample(), until=100.0)
    assert "OPEN" not in [mode for _, mode, _ in core.told]


def test_with_one_contact_only_the_other_end_is_estimated() -> None:
    core = CoreAlone(
        DoorLimits(t=DoorDurations(open_delay_s=2.0), debounce=DEBOUNCED, estimated=True)
    )
    closed = core.sees(DoorSample(closed=True), until=1.0)
    core.hears(OPENS)
    core.sees(DoorSample(closed=True), until=5.0)
    opened = core.sees(DoorSample(closed=False), until=6.0)
    assert core.told[1:] == [
        (0.0625, "CLOSED", False),
        (1.0, "CLOSED", True),
        (5.0625, "OPEN", True),
    ]
    assert (closed.report.estimated, opened.report.estimated) == (False, True)


def test_a_missing_contact_proves_nothing_if_estimates_are_forbidden() -> None:
    core = CoreAlone(DoorLimits())
    core.hears(OPENS)
    core.sees(DoorSample(), until=100.0)
    assert core.told[1:] == [(0.0, "MOVING", True), (10.0, "UNKNOWN", True)]


# ---- faults, which change no output


def test_a_door_held_for_very_long_is_reported_and_stays_held() -> None:
    core = CoreAlone(limits(max_hold_s=60.0))
    core.hears(OPENS)
    core.sees(OPEN, until=59.0)
    assert core.faults() == ()
    core.sees(OPEN, until=61.0)
    assert core.faults() == ("DOOR_OPEN_TOO_LONG: RMF has held the door for more than 60.0 s",)
    assert core.told[-1] == (0.0625, "OPEN", True)


def test_an_error_of_the_controller_is_a_fault_and_moves_nothing() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(replace(OPEN, errors=("motor too hot", "bit 9")), until=1.0)
    assert core.faults() == ("DOOR_CONTROLLER_FAULT: motor too hot; bit 9",)
    core.sees(OPEN, until=2.0)
    assert core.faults() == ()
    assert core.told == [(0.0, "OFFLINE", False), (0.0, "UNKNOWN", True), (0.0625, "OPEN", True)]


def test_a_repeated_open_does_not_delay_the_fault_of_a_long_hold() -> None:
    core = CoreAlone(limits(max_hold_s=60.0))
    for second in range(61):
        core.hears(OPENS)
        core.sees(OPEN, until=float(second))
    assert core.faults() == ("DOOR_OPEN_TOO_LONG: RMF has held the door for more than 60.0 s",)


def test_a_door_is_held_too_long_at_the_instant_for_which_the_core_wakes() -> None:
    core = CoreAlone(replace(limits(max_hold_s=0.5), debounce={}))
    core.hears(Sampled(OPEN))
    core.now = core.hears(OPENS).wake_at
    core.hears(OPENS)
    assert (core.now, core.faults()) == (
        0.5,
        ("DOOR_OPEN_TOO_LONG: RMF has held the door for more than 0.5 s",),
    )
    assert core.hears(OPENS).wake_at < math.inf


def test_an_unchanged_reading_is_no_news() -> None:
    core = CoreAlone()
    before, after = core.sees(OPEN, until=1.0).report, core.sees(OPEN, until=2.0).report
    assert (before.read_at, after.read_at) == (1.0, 2.0)
    assert before.news() == after.news()


def test_the_same_reading_once_more_changes_only_the_time_of_the_reading() -> None:
    core = CoreAlone()
    core.sees(OPEN, until=1.0)
    again = repeated(core.memory, 1.125)
    assert again == replace(core.memory, senses=replace(core.memory.senses, read_at=1.125))
    assert again != core.memory


# ---- the report


def test_a_request_that_waits_has_a_reason_until_the_door_is_open() -> None:
    core = CoreAlone()
    reasons = [core.hears(OPENS).report.waits]
    reasons.append(core.hears(Sampled(CLOSED)).report.waits)
    reasons.append(core.sees(CLOSED, until=1.0).report.waits)
    reasons.append(core.hears(RivalSeen()).report.waits)
    reasons.append(core.sees(OPEN, until=8.0).report.waits)
    assert reasons == [
        "for a reading",
        "for its contacts to be steady",
        "for the door to open",
        "until no other node publishes its states",
        "",
    ]


def test_the_fleets_alarm_gets_the_doors_fire_contact_once_it_is_steady() -> None:
    core = CoreAlone()
    alarms = [core.hears(Sampled(replace(OPEN, fire=False))).report.alarm]
    alarms.append(core.sees(replace(OPEN, fire=False), until=1.0).report.alarm)
    alarms.append(core.sees(replace(OPEN, fire=True), until=2.0).report.alarm)
    assert alarms == [
        AlarmInputs(frozenset(), False),
        AlarmInputs(frozenset(), True),
        AlarmInputs(frozenset({"fire"}), True),
    ]
