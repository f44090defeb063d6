"""Rules that the charger's core keeps in long histories. One rule limits how often the core clears
errors."""

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.charger import core
from bridges.kinds.charger.signals import Event
from tests.depth import examples
from tests.kinds.charger import story as s
from tests.kinds.charger.invariants import check
from tests.kinds.charger.walk import MOVES, SITES, World, moved, waited

steps = st.lists(st.sampled_from([*MOVES, 0.25, 1.0, 3.0, 10.0, 90.0]), max_size=60)


@settings(max_examples=examples(400))
@given(st.sampled_from(list(SITES)), steps)
def test_the_rules_hold_over_long_histories(site: str, history: list[str | float]) -> None:
    world, limits = World(), SITES[site]
    for step in history:
        if isinstance(step, str):
            world = moved(world, MOVES[step], limits, check)
        else:
            world = waited(world, step, limits, check)


@settings(max_examples=examples(200))
@given(
    st.lists(st.tuples(st.sampled_from((s.HOT, s.IDLE, s.SILENT)), st.floats(0, 30)), max_size=200),
    st.integers(0, 60),
)
def test_errors_are_never_cleared_faster_than_the_rate(
    history: list[tuple[Event, float]], per_hour: int
) -> None:
    limits = s.observed(clear_errors_per_h=per_hour)
    memory, now, cleared = core.initial(limits, 0.0), 0.0, []
    for event, later in history:
        now += later
        decision = core.decide(memory, event, now, limits)
        if decision.outputs.clear_errors > memory.clear_errors:
            cleared.append(now)
        memory = decision.memory
    assert all(b - a >= 3600 / per_hour for a, b in itertools.pairwise(cleared))
    assert per_hour or not cleared
