"""Properties of a door in long random histories of requests, readings, gaps, rivals and alarms."""

from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.door.core import decide
from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.settings import DoorDurations, Pulse
from tests.depth import examples
from tests.kinds.door.invariants import check, nothing_changes_before_wake_at
from tests.kinds.door.virtual import DEBOUNCED
from tests.kinds.door.walk import MOVES, Step, moved, start, waited

HISTORIES = st.lists(st.sampled_from([*MOVES, 0.0625, 0.125, 0.5, 1.0, 3.0, 12.0]), max_size=60)
LIMITS = st.builds(
    DoorLimits,
    t=st.builds(
        DoorDurations,
        close_grace_s=st.sampled_from([0.0, 3.0]),
        open_delay_s=st.sampled_from([None, 4.0]),
        max_hold_s=st.sampled_from([None, 5.0]),
    ),
    debounce=st.sampled_from([{}, DEBOUNCED]),
    estimated=st.booleans(),
    on_fire=st.sampled_from(["open", "release"]),
    pulse=st.sampled_from([None, Pulse(on_s=0.5, every_s=3.0)]),
)


def checked(step: Step) -> None:
    """Check the rules. Also check that the same event gives the same decision again.

    This must hold with the memory from before the decision. With the memory from after the decision,
    the outputs and the mode must be the same, except after a failed write: the next reading without one
    tells that the outputs were written.
    """
    check(step)
    once = step.decision
    assert decide(step.before, step.event, step.now, step.limits) == once
    again = decide(once.memory, step.event, step.now, step.limits)
    assert again.outputs == once.outputs
    assert step.before.write_failed or again.report.mode == once.report.mode


@settings(max_examples=examples(800))
@given(HISTORIES, LIMITS)
def test_a_doors_rules_hold_over_long_histories(
    history: list[str | float], limits: DoorLimits
) -> None:
    world = start(limits)
    for step in history:
        if isinstance(step, str):
            world = moved(world, MOVES[step], limits, checked)
        else:
            world = waited(world, step, limits, checked)
        nothing_changes_before_wake_at(world, limits)
