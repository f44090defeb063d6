"""What holds of the charger's core whatever happens: an exhaustive walk, and random histories."""

import itertools
from collections.abc import Iterable

from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.charger import core
from bridges.charger.core import Event, Memory
from bridges.charger.report import ChargerReport
from bridges.charger.signals import Activity, ChargerOutputs
from bridges.decision import Decision, IoFailed, Sampled
from bridges.rmf.definitions import ChargerStateValue as State
from tests.charger import story as s

LIMITS = s.observed(misses=2, start_timeout_s=4.0, released_s=2.0, clear_errors_per_h=60)
EVENTS: tuple[Event, ...] = (
    *s.SCANS.values(),
    s.RIVAL,
    s.RESET,
    s.AMR1,
    s.AMR2,
    s.CANCEL_1,
)


def invariants(
    before: Memory,
    event: Event,
    now: float,
    decision: Decision[Memory, ChargerOutputs, ChargerReport],
) -> None:
    """What must hold after every single decision."""
    shown, outputs, memory = decision.report, decision.outputs, decision.memory
    assert shown.state in set(State)
    assert (shown.error_message != "") == (shown.state is State.CHARGER_ERROR)
    held = memory.holder is not None
    assert held == bool(shown.request_id) == bool(shown.fleet) == bool(shown.robot)
    if shown.state in (State.CHARGER_ASSIGNED, State.CHARGER_IDLE):
        assert held == (shown.state is State.CHARGER_ASSIGNED)
    if outputs.power:
        assert held
        assert shown.state in (State.CHARGER_ASSIGNED, State.CHARGER_CHARGING)
    if shown.state is State.CHARGER_CHARGING:
        assert memory.sample is not None
        assert memory.sample.activity in (Activity.CHARGING, Activity.STOPPING)
    if before.holder and not isinstance(event, Sampled):
        assert memory.holder is not None
        assert memory.holder.request == before.holder.request
    if isinstance(event, IoFailed):
        assert memory.holder == before.holder
    assert outputs.clear_errors - before.clear_errors in (0, 1)
    assert len(memory.over) <= core.REMEMBERED


def walk(memory: Memory, now: float, depth: int, seen: set[tuple[Memory, float, int]]) -> int:
    """Every event in every state that can be reached in `depth` more steps; how many decisions."""
    if depth == 0 or (memory, now, depth) in seen:
        return 0
    seen.add((memory, now, depth))
    count = 0
    for event, later in itertools.product(EVENTS, (0.0, 3.0)):
        decision = core.decide(memory, event, now + later, LIMITS)
        invariants(memory, event, now + later, decision)
        count += 1 + walk(decision.memory, now + later, depth - 1, seen)
    return count


def test_the_invariants_hold_after_every_event_in_every_state_four_steps_deep() -> None:
    assert walk(Memory(), 0.0, 4, set()) > 10_000


@settings(derandomize=True, max_examples=300, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(EVENTS), st.sampled_from((0.0, 0.1, 1.0, 5.0, 90.0)))))
def test_the_invariants_hold_over_long_histories(history: list[tuple[Event, float]]) -> None:
    play(history)


def play(history: Iterable[tuple[Event, float]]) -> Memory:
    memory, now = Memory(), 0.0
    for event, later in history:
        now += later
        decision = core.decide(memory, event, now, LIMITS)
        invariants(memory, event, now, decision)
        memory = decision.memory
    return memory


@settings(derandomize=True, max_examples=200, deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from((s.HOT, s.IDLE, s.SILENT)), st.floats(0, 30)), max_size=200),
    st.integers(0, 60),
)
def test_errors_are_never_cleared_faster_than_the_rate(
    history: list[tuple[Event, float]], per_hour: int
) -> None:
    limits = s.observed(clear_errors_per_h=per_hour)
    memory, now, cleared = Memory(), 0.0, []
    for event, later in history:
        now += later
        decision = core.decide(memory, event, now, limits)
        if decision.outputs.clear_errors > memory.clear_errors:
            cleared.append(now)
        memory = decision.memory
    assert all(b - a >= 3600 / per_hour for a, b in itertools.pairwise(cleared))
    assert per_hour or not cleared


@settings(derandomize=True, max_examples=200, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(EVENTS), st.sampled_from((0.0, 1.0, 30.0))), max_size=30))
def test_from_everywhere_a_sound_empty_station_is_idle_again(
    history: list[tuple[Event, float]],
) -> None:
    memory = play(history)
    now = 1e6
    for _ in range(8):
        now += 1.0
        decision = core.decide(memory, s.IDLE, now, LIMITS)
        memory = decision.memory
    assert decision.report == ChargerReport(read_at=now, state=State.CHARGER_IDLE)
