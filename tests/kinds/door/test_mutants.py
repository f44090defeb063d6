"""The door's core at its edges: what a mutation run found untested (docs/mutation.md)."""

import math

import pytest
from msgspec.structs import replace

from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.settings import Durations, Pulse
from bridges.kinds.door.signals import CloseRequested, DoorSample, Event, OpenRequested
from bridges.kinds.shared.decision import (
    IoFailed,
    OperatorReset,
    RivalSeen,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.kinds.shared.durations import RIVAL_QUIET_S
from tests.kinds.door.virtual import BETWEEN, CLOSED, DEBOUNCED, OPEN, CoreAlone

OPENS, CLOSES = OpenRequested("door_supervisor"), CloseRequested("door_supervisor")
ESTIMATED = DoorLimits(t=Durations(open_delay_s=4.0, travel_s=6.0), estimated=True)
STALE_S = Durations().stale_after_s


def limits(**durations: float) -> DoorLimits:
    return DoorLimits(t=Durations(**durations), debounce=DEBOUNCED)


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


# --- what a controller says of itself ----------------------------------------------------------


def test_a_door_whose_controller_does_not_say_where_it_is_is_unknown_for_that_reason() -> None:
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


def test_the_controllers_own_errors_are_one_fault_that_moves_nothing() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(replace(OPEN, errors=("motor too hot", "bit 9")), until=1.0)
    assert core.faults() == ("DOOR_CONTROLLER_FAULT: motor too hot; bit 9",)
    core.sees(OPEN, until=2.0)
    assert core.faults() == ()
    assert core.told == [(0.0, "OFFLINE", False), (0.0, "UNKNOWN", True), (0.0625, "OPEN", True)]


# --- gaps --------------------------------------------------------------------------------------


def test_after_a_sleep_nothing_is_believed_of_the_inputs() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(OPEN, until=0.5)
    core.hears(Suspended("the machine slept"))
    assert core.faults() == ("COMMUNICATION_LOST: the machine slept",)
    core.sees(OPEN, until=1.0)
    assert core.told == [
        (0.0, "OFFLINE", False),
        (0.0, "UNKNOWN", True),
        (0.0625, "OPEN", True),
        (0.5, "OFFLINE", False),
        (0.5, "UNKNOWN", True),
        (0.5625, "OPEN", True),
    ]


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


def test_a_failed_write_does_not_start_the_debounce_of_a_contact_again() -> None:
    core = CoreAlone()
    core.sees(CLOSED, until=1.0)
    for now, event in (
        (1.0, Sampled(OPEN)),
        (1.03125, WriteFailed("no reply")),
        (1.0625, Sampled(OPEN)),
    ):
        core.now = now
        core.hears(event)
    assert core.told[-1] == (1.0625, "OPEN", False)


def test_a_silence_has_its_own_reason_and_not_that_of_an_earlier_failure() -> None:
    def silence_after(failure: Event) -> tuple[str, ...]:
        core = CoreAlone()
        core.sees(OPEN, until=1.0)
        core.hears(failure)
        core.now = 10.0
        core.hears(OPENS)
        return core.faults()

    assert silence_after(WriteFailed("no reply")) == ("COMMUNICATION_LOST: no reply",)
    core = CoreAlone()
    core.hears(IoFailed("no reply"))
    core.hears(Sampled(OPEN))
    core.now = 10.0
    core.hears(OPENS)
    assert core.faults() == (f"COMMUNICATION_LOST: no reading for {STALE_S} s",)


def test_a_hazard_half_seen_before_a_gap_is_not_a_hazard() -> None:
    core = CoreAlone(replace(limits(), on_fire="open"))
    core.hears(Sampled(replace(OPEN, fire=False, obstruction=False)))
    decided = core.hears(IoFailed("no reply"))
    assert (core.faults(), decided.outputs.hold_open) == ((), False)


# --- holds -------------------------------------------------------------------------------------


def test_a_repeated_open_does_not_put_off_the_fault_of_a_door_held_too_long() -> None:
    core = CoreAlone(limits(max_hold_s=60.0))
    for second in range(61):
        core.hears(OPENS)
        core.sees(OPEN, until=float(second))
    assert core.faults() == ("DOOR_OPEN_TOO_LONG: held for RMF longer than 60.0 s",)


def test_a_hold_that_ended_at_once_still_gives_way_to_an_obstruction() -> None:
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


# --- when it wakes -----------------------------------------------------------------------------


def test_the_core_wakes_when_its_reading_is_too_old() -> None:
    core = CoreAlone(DoorLimits())
    assert core.hears(Sampled(CLOSED)).wake_at == STALE_S


def test_the_core_wakes_when_another_node_has_been_silent_for_long_enough() -> None:
    assert CoreAlone().hears(RivalSeen()).wake_at == RIVAL_QUIET_S


def test_the_core_wakes_at_the_edges_of_each_pulse() -> None:
    core = CoreAlone(DoorLimits(t=Durations(stale_after_s=9.0), pulse=Pulse(on_s=0.5, every_s=3.0)))
    core.hears(OPENS)
    core.hears(Sampled(OPEN))
    wakes = []
    for _ in range(4):
        assert core.last is not None
        core.now = core.last.wake_at
        core.hears(OPENS)
        wakes.append(core.now)
    assert wakes == [0.5, 3.0, 3.5, 6.0]


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


def test_a_door_counts_as_held_too_long_at_the_very_instant_for_which_the_core_wakes() -> None:
    core = CoreAlone(replace(limits(max_hold_s=0.5), debounce={}))
    core.hears(Sampled(OPEN))
    core.now = core.hears(OPENS).wake_at
    core.hears(OPENS)
    assert (core.now, core.faults()) == (
        0.5,
        ("DOOR_OPEN_TOO_LONG: held for RMF longer than 0.5 s",),
    )
    assert core.hears(OPENS).wake_at < math.inf
