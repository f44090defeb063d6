"""Laws that all kinds of device share. Each kind of device gives each law an id of its own, such as
`L2.rate`."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from bridges.messages import words
from bridges.observe.limits import SLOWEST_S
from bridges.observe.requesters import Moment
from workbench.judge.history import BURST, History
from workbench.judge.law import KEPT, Finding, Law

AnyScene = History[Any]

STALE_S: Final = 5.0
"""Age (s) from which a reading counts as old."""
BURST_WITHIN_S: Final = 1.0
ANSWERS: Final = 5
BACK_S: Final = 0.5
STEPS_BACK: Final = 4
STEPS_WITHIN_S: Final = 30.0


def rate(history: AnyScene) -> Finding:
    """Check that states keep coming. If the whole network was silent, this is no breach."""
    if history.news is None and not history.states:
        return f"no state, though its topic has a publisher: {', '.join(history.senders[:4])}"
    if history.news is None:
        silent_s = history.now - history.heard_at
        own_s = silent_s - history.network_s
        return f"no state for the last {silent_s:.1f} s" if own_s > SLOWEST_S else None
    if history.new is None or history.states == 1:
        return None
    gap_s = history.seen.gap_s
    if gap_s - history.network_s > SLOWEST_S:
        return f"no state for {gap_s:.1f} s before this one"
    return KEPT if gap_s <= SLOWEST_S else None


def answers(history: AnyScene) -> Finding:
    """Check that a request alone never causes a state."""
    if history.new is None or history.often(history.turns):
        return None
    if history.burst_s < BURST_WITHIN_S:
        return f"{BURST} unchanged states in {history.burst_s:.2f} s"
    if history.answers >= ANSWERS:
        return f"{ANSWERS} of 8 requests were each answered by an unchanged state"
    return KEPT if history.tested >= ANSWERS else None


def one_node(history: AnyScene) -> Finding:
    """Check that only one node publishes the states. Stamps that go back again and again show two
    nodes. The clock of a single node may step back once."""
    if history.new is None:
        return None
    if history.seen.steps_back(history.now, BACK_S, STEPS_WITHIN_S) >= STEPS_BACK:
        return f"stamps go back and forth: {STEPS_BACK} times in 30 s"
    if history.often(history.turns):
        both = history.seen.publishers(Moment(history.now, 0.0))
        return f"two publishers take turns: {', '.join(one.node or '?' for one in both)}"
    if len(history.senders) > 1 and history.two_rhythms and not history.others:
        return f"states come at two different rates; publishers: {', '.join(history.senders[:4])}"
    return KEPT if len(history.senders) == 1 and history.has_rhythm else None


def stamped(blind: Callable[[Any], bool]) -> Callable[[AnyScene], Finding]:
    """Return a check that a state has a stamp, if a robot would act on the state. `blind(state)` tells
    whether the state says only that nothing is known."""

    def check(history: AnyScene) -> Finding:
        state = history.new
        if state is None:
            return None
        if words.stamped_at(state) > 0.0:
            return KEPT
        return None if blind(state) else f"stamp 0: {words.described(state)}"

    return check


def fresh(stale_s: float = STALE_S) -> Callable[[AnyScene], Finding]:
    """Return a check that a state on which a robot would act is not based on an old reading."""

    def check(history: AnyScene) -> Finding:
        state = history.new
        if state is None or not history.claims(state) or words.stamped_at(state) == 0.0:
            return None
        if history.frozen_s <= stale_s:
            return KEPT if history.claimed_s > stale_s else None
        return (
            f"{words.described(state)}, but its stamp has not changed for {history.frozen_s:.1f} s"
        )

    return check


RATE: Final[Law[AnyScene]] = Law(
    "RATE",
    "States come at least every 5 s, whether the hardware answers or not",
    "two states",
    "A fleet adapter sends a request after each state. Without states the robot waits for ever",
    "rmf_ros2 agv/RobotContext.cpp:1700-1735",
    rate,
)
ANSWERED: Final[Law[AnyScene]] = Law(
    "ANSWER",
    "No request causes a state: only a timer or a change causes a state",
    "5 requests between unchanged states, after a time without requests that shows the usual rate",
    "RMF repeats its request after each state. If each request caused a state, the loop would"
    " never end",
    "rmf_ros2 agv/RobotContext.cpp:1732-1735, lift_supervisor/Node.cpp:58-140",
    answers,
    sensed=True,  # a noisy wire may change other fields of the state ten times a second
)
ONE: Final[Law[AnyScene]] = Law(
    "ONE",
    "Only one node publishes under this name",
    "10 states on a live graph; `kept` also needs that their topic has only one publisher",
    "RMF believes the latest state. With two nodes the device would jump between two states",
    "follows from RequestLift.cpp and DoorOpen.cpp, which use only the latest state",
    one_node,
)
STAMP: Final[Law[AnyScene]] = Law(
    "STAMP",
    "A state on which a robot may act carries the time of its reading",
    "a state",
    "Without this time, an old value looks like a new reading. The time 0 means that nothing was read",
    "LiftState.msg, DoorState.msg, ChargerState.msg: the time of the state",
    stamped(lambda state: True),
)


def named(law: Law[AnyScene], id: str, **changes: Any) -> Law[Any]:
    """Return a shared law with the id that it has for one kind of device."""
    return replace(law, id=id, **changes)
