"""Rules that hold for any readings of a robot and any orders of RMF.

RMF must never get a stale place, or a place that does not exist. A command must not count as done
before the robot has carried it out.
"""

import math
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from bridges.kinds.fleet import core
from bridges.kinds.fleet.signals import (
    Act,
    Event,
    Goal,
    Localize,
    Navigate,
    PadHeard,
    Pose,
    RobotSample,
    Stop,
)
from bridges.kinds.shared.decision import IoFailed, OperatorReset, Sampled
from tests.depth import examples
from tests.kinds.fleet.story import LIMITS, at

PLACES = [at(0.0), at(4.8), at(5.0), at(8.0, level="L2"), Pose("cellar", 0.0, 0.0)]
NUMBERS = st.sampled_from([0.0, 0.5, 1.0, 1.5, -1.0, math.nan, math.inf])
GOALS = st.builds(
    Goal,
    st.sampled_from(PLACES[:4]),
    st.sampled_from(["", "pantry", "charger_a"]),
    st.sampled_from(["", "dock_a"]),
)
IDS = st.integers(1, 2)
STRANGE = st.builds(Pose, st.just("L1"), NUMBERS, NUMBERS, NUMBERS)
SAMPLES = st.builds(
    RobotSample,
    at=st.one_of(
        st.sampled_from(PLACES), st.builds(Pose, st.just("L1"), NUMBERS, NUMBERS, NUMBERS)
    ),
    battery=st.one_of(st.just(0.5), NUMBERS),
    moving=st.sampled_from([None, True, False]),
    charging=st.sampled_from([None, True, False]),
    completed=st.sampled_from([None, "1", "2"]),
    fault=st.sampled_from(["", "hot"]),
    said_at=st.sampled_from([None, 1.0, 2.0]),
    refused=st.sampled_from(["", "no"]),
)
EVENTS: st.SearchStrategy[Event] = st.one_of(
    st.builds(Sampled, SAMPLES),
    st.just(IoFailed("silent")),
    st.just(OperatorReset()),
    st.builds(Navigate, IDS, GOALS),
    st.builds(Localize, IDS, GOALS),
    st.builds(Act, IDS, st.just("clean")),
    st.builds(Stop, IDS, IDS),
    st.builds(PadHeard, st.just("charger_a"), st.booleans()),
)
STEPS = st.lists(st.tuples(EVENTS, st.sampled_from([0.0, 0.1, 1.0, 20.0])), max_size=30)


@settings(max_examples=examples(800))
@given(steps=STEPS)
def test_rmf_gets_only_fresh_and_possible_places_and_true_ends(
    steps: list[tuple[Any, float]],
) -> None:
    now = 100.0
    memory = core.initial(LIMITS, now)
    for event, later_s in steps:
        now += later_s
        before = memory
        decision = core.decide(memory, event, now, LIMITS)
        memory, report = decision.memory, decision.report
        assert decision.wake_at > now
        assert 0.0 <= report.battery <= 1.0
        if report.at is not None:
            assert isinstance(event, Sampled) or before.fresh
            assert report.at.map in ("L1", "L2")
            assert all(map(math.isfinite, (report.at.x, report.at.y, report.at.yaw)))
        if memory.finished != before.finished:
            is_new = isinstance(event, Navigate | Localize | Act)  # the robot stood there already
            done = event if is_new else before.command
            assert done is not None
            assert memory.finished == done.id
            assert memory.command is None
            goal = getattr(done, "goal", None)
            if goal is not None:
                assert memory.reading is not None
                assert memory.reading.at.map == goal.at.map
                far = math.hypot(memory.reading.at.x - goal.at.x, memory.reading.at.y - goal.at.y)
                assert far <= core.RELOCALISED_M
