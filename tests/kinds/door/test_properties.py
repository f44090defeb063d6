"""What holds for a door in every history: of requests, readings, gaps, rivals and alarms."""

from dataclasses import dataclass
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.door.core import decide, initial
from bridges.kinds.door.memory import DoorLimits, Memory
from bridges.kinds.door.settings import Durations, Pulse
from bridges.kinds.door.signals import CloseRequested, DoorSample, Event, OpenRequested
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled
from bridges.kinds.shared.durations import RIVAL_QUIET_S
from bridges.messages.definitions import DoorModeValue
from tests.depth import examples
from tests.kinds.door.virtual import DEBOUNCED, Decided

CONTACT = st.sampled_from([None, False, True])
SAMPLES = st.builds(DoorSample, opened=CONTACT, closed=CONTACT, obstruction=CONTACT, fire=CONTACT)
EVENTS: st.SearchStrategy[Event] = st.one_of(
    SAMPLES.map(Sampled),
    SAMPLES.map(Sampled),
    st.just(OpenRequested("a")),
    st.just(CloseRequested("a")),
    st.just(IoFailed("no reply")),
    st.just(RivalSeen()),
    st.just(OperatorReset()),
)
STEPS = st.lists(
    st.tuples(st.sampled_from([0.0, 0.0625, 0.125, 0.5, 1.0, 3.0, 12.0]), EVENTS), max_size=40
)
LIMITS = st.builds(
    DoorLimits,
    t=st.builds(
        Durations,
        close_grace_s=st.sampled_from([0.0, 3.0]),
        open_delay_s=st.sampled_from([None, 4.0]),
        max_hold_s=st.sampled_from([None, 5.0]),
    ),
    debounce=st.just(DEBOUNCED),
    estimated=st.booleans(),
    on_fire=st.sampled_from(["open", "release"]),
    pulse=st.sampled_from([None, Pulse(on_s=0.5, every_s=3.0)]),
)


@dataclass
class Ledger:
    """The rules once more, in other words: who wants the door, and what has been seen when."""

    limits: DoorLimits
    wanted: bool = False
    ends_at: float | None = None
    read_at: float | None = None
    rival_at: float | None = None
    opened_at: float | None = None

    def note(self, event: Event, now: float, decided: Decided) -> None:
        if self.ends_at is not None and now >= self.ends_at:
            self.wanted, self.ends_at = False, None
        match event:
            case OpenRequested() if not decided.refused:
                self.wanted, self.ends_at = True, None
            case CloseRequested() if self.wanted and self.ends_at is None:
                self.ends_at = now + self.limits.t.close_grace_s
                self.wanted = self.ends_at > now
            case Sampled(sample):
                self.read_at = now
                self.opened_at = now if sample.opened else self.opened_at
            case RivalSeen():
                self.rival_at = now
        if not self.wanted:
            self.ends_at = None
        if "FIRE_ALARM" in codes(decided) and self.limits.on_fire == "release":
            self.wanted, self.ends_at = False, None

    def sees(self, now: float) -> bool:
        """A fresh reading, and no rival."""
        fresh = self.read_at is not None and now < self.read_at + self.limits.t.stale_after_s
        return fresh and (self.rival_at is None or now >= self.rival_at + RIVAL_QUIET_S)


def codes(decided: Decided) -> set[str]:
    return {fault.code for fault in decided.report.faults}


def history(steps: list[tuple[float, Event]], limits: DoorLimits) -> Any:
    """Each step: its time, the ledger after it, and what was decided."""
    memory: Memory = initial(limits, 0.0)
    ledger, now = Ledger(limits), 0.0
    for pause_s, event in steps:
        now += pause_s
        decided = decide(memory, event, now, limits)
        memory = decided.memory
        ledger.note(event, now, decided)
        yield now, ledger, decided


@settings(max_examples=examples(400))
@given(steps=STEPS, limits=LIMITS)
def test_the_hold_is_on_for_a_reason_and_off_without_one(
    steps: list[tuple[float, Event]], limits: DoorLimits
) -> None:
    for now, ledger, decided in history(steps, limits):
        fire = "FIRE_ALARM" in codes(decided)
        reason = limits.on_fire == "open" if fire else ledger.wanted
        obstructed = "DOOR_OBSTRUCTED" in codes(decided)
        assert decided.report.hold == (ledger.sees(now) and (reason or obstructed))
        assert not (obstructed and ledger.wanted)


@settings(max_examples=examples(400))
@given(steps=STEPS, limits=LIMITS)
def test_open_is_reported_from_fresh_contacts_only(
    steps: list[tuple[float, Event]], limits: DoorLimits
) -> None:
    for now, ledger, decided in history(steps, limits):
        if decided.report.mode == DoorModeValue.MODE_OPEN:
            assert ledger.sees(now)
            assert limits.estimated or ledger.opened_at is not None
            assert not ("FIRE_ALARM" in codes(decided) and limits.on_fire == "release")
        if not ledger.sees(now):
            assert decided.report.mode == DoorModeValue.MODE_OFFLINE


@settings(max_examples=examples(400))
@given(steps=STEPS, limits=LIMITS)
def test_the_relay_follows_the_hold_and_nothing_else(
    steps: list[tuple[float, Event]], limits: DoorLimits
) -> None:
    for _, _, decided in history(steps, limits):
        assert decided.report.hold or not decided.outputs.hold_open
        if limits.pulse is None:
            assert decided.outputs.hold_open == decided.report.hold


@settings(max_examples=examples(400))
@given(steps=STEPS, limits=LIMITS)
def test_the_stamp_is_the_time_of_the_last_reading(
    steps: list[tuple[float, Event]], limits: DoorLimits
) -> None:
    for _, ledger, decided in history(steps, limits):
        assert decided.report.read_at == ledger.read_at


@settings(max_examples=examples(400))
@given(steps=STEPS, limits=LIMITS)
def test_a_decision_repeated_is_the_same_decision(
    steps: list[tuple[float, Event]], limits: DoorLimits
) -> None:
    memory, now = initial(limits, 0.0), 0.0
    for pause_s, event in steps:
        now += pause_s
        once = decide(memory, event, now, limits)
        assert decide(memory, event, now, limits) == once
        again = decide(once.memory, event, now, limits)
        assert (again.outputs, again.report.mode) == (once.outputs, once.report.mode)
        assert once.wake_at > now
        memory = once.memory


@settings(max_examples=examples(400))
@given(steps=STEPS, limits=LIMITS)
def test_the_decision_stays_the_same_until_the_time_the_core_asked_to_be_woken(
    steps: list[tuple[float, Event]], limits: DoorLimits
) -> None:
    memory, now = initial(limits, 0.0), 0.0
    for pause_s, event in steps:
        now += pause_s
        decided = decide(memory, event, now, limits)
        memory = decided.memory
        just_before = min(decided.wake_at, now + 100.0) - 2.0**-20
        if just_before > now:
            later = decide(memory, OperatorReset(), just_before, limits)
            assert (later.outputs, later.report) == (decided.outputs, decided.report)
