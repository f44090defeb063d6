"""Properties that hold for every order of events, and in spite of losses, delays, copies and
restarts."""

import random
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridges.kinds.lift_supervisor import core
from bridges.kinds.lift_supervisor.memory import (
    NOBODY_IS_SENT,
    LiftSupervisorLimits,
    SupervisedLift,
)
from bridges.kinds.lift_supervisor.signals import LiftStateHeard, RideEnded, RideRequested, Target
from bridges.kinds.shared.durations import GAP_S, REPEAT_S
from bridges.kinds.shared.graph_kind import MaySpeak, Woken
from bridges.messages.definitions import LiftMode
from tests.depth import depth, examples
from tests.kinds.lift_supervisor.alone import words
from tests.kinds.lift_supervisor.world import LiftNode, OurSupervisor, Rider, requests
from tests.runtime.virtual_graph import World
from tests.walk import reached

TRIPS = [("L1", "L3"), ("L3", "L1"), ("L2", "L1")]
NAMES = ["fleet/a", "fleet/b", "fleet/c"]


def bad_network(rng: random.Random, loss: float) -> Any:
    """Return a function that gives the delays of a message's copies. The function loses, doubles and
    reorders messages.

    A delay is at most half a second.
    """

    def route(sender: str, receiver: str) -> Sequence[float]:
        copies = 0 if rng.random() < loss else 2 if rng.random() < 0.1 else 1
        return [rng.random() * 0.5 for _ in range(copies)]

    return route


def check_rates(requests: list[tuple[float, str]]) -> None:
    """Require 0.1 s between any two messages, and 1 s between two equal messages.

    Require also at most 20 messages in any 10 s.
    """
    for (at, text), (later, again) in pairwise(requests):
        assert later - at >= (0.999 if text == again else 0.099), (at, text, again)
    for at, _ in requests:
        assert sum(at <= other < at + 10.0 for other, _ in requests) <= 20


Restart = st.tuples(st.floats(0, 150), st.sampled_from(["supervisor", "Lift1", *NAMES]))


@settings(max_examples=examples(25))
@given(
    seed=st.integers(0, 2**32 - 1),
    loss=st.sampled_from([0.0, 0.1, 0.3]),
    our_skew=st.sampled_from([0.0, -3600.0, 3600.0]),
    restarts=st.lists(Restart, max_size=6),
)
# once, a late state made the core send END again
@example(seed=1, loss=0.0, our_skew=0.0, restarts=[])
def test_every_live_robot_is_served_in_spite_of_losses_and_restarts(
    seed: int, loss: float, our_skew: float, restarts: list[tuple[float, str]]
) -> None:
    rng = random.Random(seed)
    world = World(bad_network(rng, loss))
    parties: dict[str, Any] = {"supervisor": OurSupervisor(world, wall_skew=our_skew)}
    parties["Lift1"] = LiftNode(world)
    for name in NAMES:
        trips = [rng.choice(TRIPS) for _ in range(2)]
        skew = rng.choice([0.0, -3600.0, 300.0])
        starts_at = rng.uniform(0, 20)
        parties[name] = Rider(world, name, *trips, starts_at=starts_at, skew=skew)
    for at, name in sorted(restarts):
        world.run(at)
        parties[name].restart()
    riders = [parties[name] for name in NAMES]
    world.run(world.now + 600.0, lambda: all(rider.done for rider in riders))
    assert [rider.trips for rider in riders] == [[], [], []]
    if not any(name == "supervisor" for _, name in restarts):
        check_rates(requests(world))


@settings(max_examples=examples(20))
@given(
    restarts=st.lists(st.tuples(st.floats(5, 60), st.sampled_from(["supervisor", "Lift1"]))),
    skews=st.tuples(*[st.sampled_from([0.0, -3600.0, 300.0])] * 3),
    our_skew=st.sampled_from([0.0, -3600.0, 3600.0]),
)
def test_no_restart_of_ours_ends_a_ride_with_the_robot_in_the_car(
    restarts: list[tuple[float, str]], skews: tuple[float, ...], our_skew: float
) -> None:
    world = World()
    parties: dict[str, Any] = {"supervisor": OurSupervisor(world, wall_skew=our_skew)}
    parties["Lift1"] = LiftNode(world)
    riders = {
        name: Rider(world, name, *TRIPS, starts_at=5.0 + number, skew=skews[number])
        for number, name in enumerate(NAMES)
    }
    ended_inside = []

    def watch(sender: str, topic: Any, message: Any) -> None:
        if sender == "supervisor" and message.request_type == 0:
            rider = riders[message.session_id]
            if rider.robot.in_car:
                ended_inside.append((world.now, message))

    world.watch = watch
    for at, name in sorted(restarts):
        world.run(at)
        parties[name].restart()
    world.run(world.now + 600.0, lambda: all(rider.done for rider in riders.values()))
    assert ended_inside == []
    assert all(rider.done for rider in riders.values())


# --- the core alone ----------------------------------------------------------------------------

LIMITS = LiftSupervisorLimits(holder_alarm_s=15.0, holder_ttl_s=20.0)


class Watched:
    """The core alone. `hears` checks each decision by the rules."""

    def __init__(
        self, memory: SupervisedLift, now: float, limits: LiftSupervisorLimits = LIMITS
    ) -> None:
        self.memory = memory
        self.now = now
        self.limits = limits
        self.wake_at = float("inf")

    def hears(self, event: Any) -> str:
        """Make one decision. Return the message that the core sends, or "" without a message."""
        before = self.memory
        decided = core.decide(before, event, self.now, self.limits)
        self.memory = memory = decided.memory
        self.wake_at = decided.wake_at
        assert decided.wake_at > self.now
        assert len(decided.publish) <= 1
        assert len({claim.session for claim in memory.claims}) == len(memory.claims)
        since = [claim.since for claim in memory.claims]
        assert since == sorted(since), "the queue is out of order"
        self._check_turn(before, memory, event)
        if not decided.publish:
            return ""
        message: Any = decided.publish[0][1]
        text = words(message)
        assert memory.may_speak
        assert self.now >= before.sent_at + GAP_S
        assert memory.turn
        assert message.session_id == memory.turn.session
        if message.request_type != 0:
            assert memory.session_shown in ("", message.session_id)
        if message.request_type == 1:
            assert not (memory.shown and memory.shown.mode in NOBODY_IS_SENT)
        if before.sent is not None and before.turn == memory.turn and words(before.sent) == text:
            assert self.now >= before.sent_at + REPEAT_S
        return text

    def _check_turn(self, before: SupervisedLift, after: SupervisedLift, event: Any) -> None:
        """Require a reason whenever the turn of a session ends.

        A reason is that END was sent and a later state shows another session or none. The other reason
        is that the lift shows another session.
        """
        if not after.may_speak:
            assert after.turn is None
            return
        if before.turn is None or (after.turn and after.turn.session == before.turn.session):
            return
        if before.turn.ends:
            assert isinstance(event, LiftStateHeard)
            assert event.session != before.turn.session
            assert before.sent is not None
        else:
            shown = after.session_shown
            assert after.turn
            assert after.turn.session == shown != before.turn.session, (
                "another session has the lift"
            )


def events_at(now: float) -> list[Any]:
    """Return the events that the walk tries at the time `now`."""
    agv, fire = LiftMode.MODE_AGV, LiftMode.MODE_FIRE
    return [
        RideRequested("a", Target(1, "L3", 2), now, 0.0),
        RideRequested("b", Target(1, "L1", 2), now, 0.0),
        RideEnded("a", now, 0.0),
        RideEnded("b", now, 0.0),
        LiftStateHeard("", "L1", "", 0, agv),
        LiftStateHeard("a", "L3", "L3", 2, agv),
        LiftStateHeard("b", "L1", "L3", 1, agv),
        LiftStateHeard("", "L1", "", 2, fire),
        MaySpeak(True),
        MaySpeak(False),
    ]


@pytest.mark.parametrize(
    ("steps", "steps_s", "at_least"),
    [(depth(3, 4), (1.0, 3.5), depth(1000, 5000)), (depth(4, 5), (1.0,), depth(1000, 5000))],
)
@pytest.mark.parametrize("may_speak", [True, False])
def test_every_order_of_events_to_this_depth_keeps_the_rules(
    may_speak: bool, steps: int, steps_s: tuple[float, ...], at_least: int
) -> None:
    """If two histories reach the same memory at the same time, the walk continues only one of them."""
    memory = core.initial("Lift1", 0.0)
    memory = core.decide(memory, MaySpeak(may_speak), 0.0, LIMITS).memory

    def neighbours(state: tuple[SupervisedLift, float]) -> Iterator[tuple[SupervisedLift, float]]:
        before, then = state
        for now in (then + step_s for step_s in steps_s):
            for event in events_at(now):
                desk = Watched(before, now)
                desk.hears(event)
                yield desk.memory, now

    assert len(reached([(memory, 0.0)], steps, neighbours, key=repr)) > at_least


@st.composite
def histories(draw: st.DrawFn) -> list[tuple[float, int]]:
    """Draw a history of events. Each event is a pair: the pause (s) before it, and the event's
    number."""
    gap = st.sampled_from([0.0, 0.05, 0.1, 0.5, 1.0, 2.5, 4.0, 11.0])
    return draw(st.lists(st.tuples(gap, st.integers(0, 9)), max_size=60))


@settings(max_examples=examples(300))
@given(histories())
@example([(0.0, 8), (0.0, 0), (0.05, 2), (0.0, 4), (0.1, 1)])
def test_long_histories_keep_the_rules_too(history: list[tuple[float, int]]) -> None:
    desk = Watched(core.initial("Lift1", 0.0), 0.0)
    for gap, number in history:
        until = desk.now + gap
        while desk.wake_at <= until:
            desk.now = desk.wake_at
            desk.hears(Woken())
        desk.now = until
        desk.hears(events_at(desk.now)[number])


@settings(max_examples=examples(100))
@given(histories())
def test_from_every_state_a_robot_that_asks_gets_a_lift_that_obeys(
    history: list[tuple[float, int]],
) -> None:
    desk = Watched(core.initial("Lift1", 0.0), 0.0)
    for gap, number in history:
        desk.now += gap
        desk.hears(events_at(desk.now)[number])
    desk.hears(MaySpeak(True))
    lift = desk.memory.session_shown
    for _ in range(60):
        desk.now += 1.0
        lift = obeys(lift, desk.hears(RideRequested("c", Target(1, "L2", 2), desk.now, 0.0)))
        shown = LiftStateHeard(lift, "L2", "L2" * bool(lift), 2, LiftMode.MODE_AGV)
        lift = obeys(lift, desk.hears(shown))
    assert lift == "c"


def obeys(session: str, text: str) -> str:
    """Return the session that has the lift after this request. `session` had the lift before the
    request."""
    kind, who = (*text.split(" "), "", "")[:2]
    if kind == "AGV" and not session:
        return who
    return "" if kind == "END" and who == session else session
