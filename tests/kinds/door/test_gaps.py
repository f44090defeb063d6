"""DOOR-5, DOOR-SENSING-1, DOOR-SENSING-2: a door whose readings fail, stop or come late."""

import pytest
from msgspec.structs import replace

from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.report import DoorReport
from bridges.kinds.door.settings import DoorDurations
from bridges.kinds.door.signals import DoorSample, Event
from bridges.kinds.shared.decision import (
    AlarmInputs,
    Fault,
    IoFailed,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.messages.definitions import DoorModeValue
from tests.kinds.door.virtual import (
    BETWEEN,
    CLOSED,
    CLOSES,
    OPEN,
    OPENS,
    STALE_S,
    CoreAlone,
    limits,
)


def test_with_an_old_reading_a_door_is_offline_without_hold_but_remembers_the_request() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    decided = core.sees(IoFailed("no reply"), until=5.0)
    assert decided.report == DoorReport(
        mode=DoorModeValue.MODE_OFFLINE,
        read_at=1.0,
        faults=(Fault("COMMUNICATION_LOST", "no reply"),),
        waits="for a reading",
    )
    core.sees(CLOSED, until=6.0)
    assert core.told[2:] == [
        (0.0625, "OPEN", True),
        (2.0, "OFFLINE", False),
        (5.0, "UNKNOWN", True),
        (5.0625, "CLOSED", True),
    ]


def test_a_short_gap_in_the_readings_changes_nothing() -> None:
    core = CoreAlone()
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    core.sees(IoFailed("no reply"), until=1.875)
    core.sees(OPEN, until=2.5)
    assert core.told[2:] == [(0.0625, "OPEN", True)]
    assert core.faults() == ()


def test_after_a_gap_a_contact_must_settle_again() -> None:
    core = CoreAlone(DoorLimits(debounce={"opened": 0.5}))
    core.sees(BETWEEN, until=2.0)
    core.sees(OPEN, until=2.375)
    core.hears(IoFailed("no reply"))
    core.sees(OPEN, until=3.5)
    assert core.told == [
        (0.0, "UNKNOWN", False),
        (0.5, "MOVING", False),
        (2.875, "OPEN", False),
    ]


@pytest.mark.parametrize(
    ("contact", "before", "after"),
    [
        ("closed", BETWEEN, CLOSED),
        ("obstruction", replace(OPEN, obstruction=True), replace(OPEN, obstruction=False)),
        ("fire", replace(OPEN, fire=True), replace(OPEN, fire=False)),
    ],
)
def test_after_a_gap_every_contact_must_settle_again(
    contact: str, before: DoorSample, after: DoorSample
) -> None:
    core = CoreAlone(DoorLimits(DoorDurations(hazard_clear_s=0.5), debounce={contact: 0.5}))
    core.sees(before, until=2.0)
    core.sees(after, until=2.375)
    core.hears(IoFailed("no reply"))
    seen = []
    for at in (2.5, 2.75, 2.875):
        core.sees(after, until=at)
        value = getattr(core.memory.senses, contact).value
        seen.append(value == getattr(after, contact))
    assert seen == [False, False, True]


@pytest.mark.parametrize("hazard", ["obstruction", "fire"])
def test_a_bus_that_fails_at_every_second_reading_hides_no_hazard(hazard: str) -> None:
    core = CoreAlone(DoorLimits(debounce={hazard: 0.5}))
    core.sees(replace(OPEN, obstruction=False, fire=False), until=2.0)
    for _ in range(5):
        core.hears(IoFailed("no reply"))
        core.sees(replace(OPEN, **{hazard: True}), until=core.now + 0.125)
    assert getattr(core.memory.senses, hazard).value is True


def test_a_door_behind_a_bus_that_fails_at_every_second_reading_is_not_shown_open_for_long() -> (
    None
):
    core = CoreAlone(DoorLimits(debounce={"opened": 0.5, "closed": 0.5}))
    core.hears(OPENS)
    core.sees(OPEN, until=2.0)
    while core.now < 6.0:
        core.hears(IoFailed("no reply"))
        core.sees(CLOSED, until=core.now + 0.125)
    assert core.told[-2:] == [(0.5, "OPEN", True), (4.5, "UNKNOWN", True)]
    assert core.faults() == ("DOOR_CONTACTS_UNSTEADY: opened and closed: not steady within 2 s",)
    core.sees(CLOSED, until=6.75)
    assert core.told[-1][1] == "CLOSED"
    assert "DOOR_CONTACTS_UNSTEADY" not in str(core.faults())


def chatters(core: CoreAlone, hazard: str, until: float) -> None:
    """Let this contact of an open door change faster than its debounce."""
    core.limits = replace(core.limits, debounce={hazard: 0.5})
    core.sees(replace(OPEN, obstruction=False, fire=False), until=core.now + 1.0)
    on = False
    while core.now < until:
        on = not on
        core.sees(
            replace(OPEN, **{"obstruction": False, "fire": False, hazard: on}), core.now + 0.25
        )


def test_a_fire_contact_that_chatters_is_a_fire_until_it_was_clear() -> None:
    """DOOR-SENSING-2: the contact changes from 2 s on. It has a debounce of 0.5 s and RESTLESS_S."""
    core = CoreAlone(limits())
    core.sees(OPEN, until=1.0)
    core.hears(OPENS)
    chatters(core, "fire", until=8.0)
    assert core.last is not None
    assert core.last.report.alarm == AlarmInputs(frozenset({"fire"}), True)
    assert core.faults() == (
        "FIRE_ALARM: the door is released",
        "HAZARD_INPUTS_UNSTEADY: fire: not steady within 2 s",
    )
    assert core.told[-1] == (4.5, "UNKNOWN", False)
    core.sees(replace(OPEN, obstruction=False, fire=False), until=10.0)
    assert core.faults() == ()
    assert core.told[-1] == (8.75, "OPEN", False)


def test_an_obstruction_that_chatters_holds_a_door_that_closes() -> None:
    """DOOR-SENSING-2 and DOOR-3."""
    core = CoreAlone(limits(close_grace_s=4.0))
    core.hears(OPENS)
    core.sees(OPEN, until=1.0)
    core.hears(CLOSES)
    chatters(core, "obstruction", until=8.0)
    assert core.told[-1] == (0.0625, "OPEN", True)
    assert core.faults() == (
        "HAZARD_INPUTS_UNSTEADY: obstruction: not steady within 2 s",
        "DOOR_OBSTRUCTED: held open after CLOSE while the doorway is not clear",
    )


def test_a_hazard_with_a_long_debounce_is_no_fault_before_it_counts() -> None:
    """DOOR-SENSING-2: the debounce is longer than `hazard_clear_s`."""
    core = CoreAlone(DoorLimits(DoorDurations(stale_after_s=60.0), debounce={"fire": 3.0}))
    core.sees(replace(OPEN, fire=False), until=4.0)
    told = []
    for core.now in (5.0, 9.5, 10.0):
        core.hears(Sampled(replace(OPEN, fire=True)))
        core.hears(Sampled(replace(OPEN, fire=False)))
        told.append([fault.split(":")[0] for fault in core.faults()])
    assert told == [[], [], ["FIRE_ALARM", "HAZARD_INPUTS_UNSTEADY"]]


def test_the_core_wakes_when_a_hazards_input_counts_as_restless() -> None:
    """DOOR-SENSING-2."""
    core = CoreAlone(DoorLimits(DoorDurations(stale_after_s=60.0), debounce={"fire": 0.5}))
    core.sees(replace(OPEN, fire=False), until=2.0)
    wakes = []
    for now in (2.25, 4.5, 4.75):
        core.now = now
        core.hears(Sampled(replace(OPEN, fire=False)))
        wakes.append(core.hears(Sampled(replace(OPEN, fire=True))).wake_at)
    assert wakes == [2.75, 4.75, 5.25]


def test_after_one_reading_and_a_gap_the_position_of_a_door_is_unknown() -> None:
    core = CoreAlone()
    core.hears(IoFailed("no reply"))
    core.sees(OPEN, until=0.0)
    core.hears(IoFailed("no reply"))
    core.now = 0.9
    core.hears(IoFailed("no reply"))
    assert core.told == [(0.0, "OFFLINE", False), (0.0, "UNKNOWN", False)]


def test_a_missing_scan_counts_as_a_lost_connection() -> None:
    core = CoreAlone()
    core.sees(OPEN, until=1.0)
    core.now = 3.0
    core.hears(OPENS)
    assert core.told[-1] == (3.0, "OFFLINE", False)
    assert core.faults() == ("COMMUNICATION_LOST: no reading for 1.0 s",)


def test_after_the_machine_slept_no_input_is_believed() -> None:
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


def test_a_silence_gives_its_own_reason_and_not_an_earlier_reason() -> None:
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


def test_a_hazard_that_has_not_settled_before_a_gap_is_no_hazard() -> None:
    core = CoreAlone(replace(limits(), on_fire="open"))
    core.hears(Sampled(replace(OPEN, fire=False, obstruction=False)))
    decided = core.hears(IoFailed("no reply"))
    assert (core.faults(), decided.outputs.hold_open) == ((), False)


def test_the_core_wakes_when_its_reading_is_too_old() -> None:
    core = CoreAlone(DoorLimits())
    assert core.hears(Sampled(CLOSED)).wake_at == STALE_S
