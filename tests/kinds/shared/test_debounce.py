"""The debounce of one input, sample by sample."""

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from bridges.kinds.shared.debounce import Settled, fear, forget, settle

HOLD_S = 0.05


def believed(samples: Sequence[tuple[float, object]], hold_s: float = HOLD_S) -> list[object]:
    seen: Settled[object] | None = None
    values = []
    for now, value in samples:
        seen = settle(seen, value, now, hold_s)
        values.append(seen.value if seen.steady_at is not None else "?")
    return values


def test_a_value_counts_after_it_has_lasted_for_the_debounce() -> None:
    samples = [(0.0, True), (0.03, True), (0.05, True), (0.1, False), (0.14, False), (0.16, False)]
    assert believed(samples) == ["?", "?", True, True, True, False]


def test_a_glitch_restarts_the_debounce() -> None:
    samples = [(0.0, 1), (0.05, 1), (0.1, 2), (0.14, 1), (0.15, 2), (0.19, 2), (0.2, 2)]
    assert believed(samples) == ["?", 1, 1, 1, 1, 1, 2]


def test_without_debounce_the_first_sample_counts() -> None:
    assert believed([(0.0, True), (0.0, False)], hold_s=0.0) == [True, False]


def test_the_absence_of_a_value_is_debounced_like_any_value() -> None:
    samples = [(0.0, None), (0.06, None), (0.1, "up"), (0.16, "up"), (0.2, None), (0.26, None)]
    assert believed(samples) == ["?", None, None, "up", "up", None]


def test_the_debounce_tells_when_the_value_just_read_will_count() -> None:
    first = settle(None, 1, 10.0, HOLD_S)
    assert first.due_at(HOLD_S) == 10.0 + HOLD_S
    steady = settle(first, 1, 10.0 + HOLD_S, HOLD_S)
    assert steady.due_at(HOLD_S) == float("inf")
    assert settle(steady, 2, 20.0, HOLD_S).due_at(HOLD_S) == 20.0 + HOLD_S


def test_the_debounce_tells_since_when_no_value_has_lasted() -> None:
    seen = settle(None, 0, 0.0, HOLD_S)
    torn = []
    for i, value in enumerate([0, 0, 1, 0, 1, 1, 1]):
        seen = settle(seen, value, 0.1 + 0.04 * i, HOLD_S)
        torn.append(seen.torn_since)
    since = 0.1 + 0.04 * 2
    assert torn == [None, None, since, since, since, since, None]


def test_after_a_gap_the_believed_value_stays_and_a_new_value_starts_again() -> None:
    steady = Settled(1, 1, 0.0, steady_at=0.1)
    half = settle(steady, 2, 1.0, HOLD_S)
    assert forget(half) == Settled(1, 1, 1.0, steady_at=0.1, torn_since=1.0)
    assert forget(steady) == steady
    again = settle(forget(settle(None, 1, 0.0, HOLD_S)), 1, 5.0, HOLD_S)
    assert again == Settled(None, 1, 5.0, torn_since=0.0), "it has kept changing since its start"
    assert forget(None) is None


def test_a_hazard_counts_at_any_reading_after_its_input_has_kept_changing() -> None:
    """After 2 s on top of the debounce. If the input has never settled, only at a reading that shows
    the hazard."""
    torn = Settled(False, False, 4.9, steady_at=1.0, torn_since=2.0)
    assert fear(torn, 4.5, 1.0) == torn
    assert fear(torn, 5.0, 1.0) == Settled(True, False, 4.9, steady_at=5.0, torn_since=2.0)
    new = Settled(None, True, 4.9, torn_since=2.0)
    assert fear(new, 5.0, 1.0) == Settled(True, True, 4.9, steady_at=5.0, torn_since=2.0)
    calm = Settled(None, False, 4.9, torn_since=2.0)
    assert fear(calm, 5.0, 1.0) == calm


@given(st.lists(st.tuples(st.floats(0.001, 0.1), st.booleans()), min_size=1, max_size=60))
def test_a_believed_value_was_read_during_its_whole_debounce(
    steps: list[tuple[float, bool]],
) -> None:
    now, seen, samples = 0.0, None, list[tuple[float, bool]]()
    for gap_s, value in steps:
        now += gap_s
        samples.append((now, value))
        before = seen
        seen = settle(seen, value, now, HOLD_S)
        if before is not None and before.steady_at is not None and before.value == seen.value:
            continue
        recent = {v for at, v in samples if at + HOLD_S > now}
        if seen.steady_at is not None:
            assert recent == {seen.value}
            assert samples[0][0] + HOLD_S <= now
