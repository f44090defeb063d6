"""The laws of a node that tells fleets about an alarm. RMF's fleet adapters obey the latest message of
any node: a `true` stops their robots, and any `false` lets the robots drive."""

from typing import Final

from workbench.judge.alarm_history import AlarmHistory
from workbench.judge.history import NOT_YET
from workbench.judge.law import KEPT, Doubt, Finding, Law, shown

HANDLES: Final = "rmf_ros2 FleetUpdateHandle::handle_emergency"
ALARMS_END_S: Final = 3.0
"""The longest time (s) between the `false` messages of nodes that end one alarm together."""
FALSES: Final = 3
"""Number of needless `false` in a row that is a breach. One needless `false` may mean that the listener
missed a `true`."""
TOLD_S: Final = 2.0
"""The longest time (s) between a statement in the diagnostics and the message that belongs to it. It is
also the longest time from another node's `false` to the repeated `true`. Statements come each
second."""


def _is_false(history: AlarmHistory) -> bool:
    return history.said is not None and not history.said.on


def _no_false(history: AlarmHistory) -> Finding:
    """Check that the node sends `false` only after its own `true`. A few needless `false` are no
    breach, because the listener may have missed the `true`."""
    if not _is_false(history):
        return None
    if history.needless >= FALSES:
        return f"it sent `false` {FALSES} times without an alarm of its own"
    return None if history.needless else KEPT


def _others(history: AlarmHistory) -> Finding:
    """Check that the node's `false` ends no other node's alarm. If the other node ends its own alarm
    within ALARMS_END_S, this is no breach."""
    if not _is_false(history):
        return None
    at, stood = history.now, history.stood
    if not stood:
        return KEPT if history.others else None
    text = f"`false` during the alarm of {shown(stood[0])}"
    over = history.over
    return Doubt(text, lambda: all(over.get(n, NOT_YET) >= at for n in stood), ALARMS_END_S)


def _same_fleets(history: AlarmHistory) -> Finding:
    said, told = history.said, history.told_before
    if said is None or said.on or told is None:
        return None
    if not said.fleets or (told and told <= said.fleets):
        return KEPT
    left = ", ".join(map(shown, sorted(told - said.fleets))) or "the other fleets"
    return f"its `false` leaves {left} standing"


def _again(history: AlarmHistory) -> Finding:
    """Check that the node repeats `true` after another node's `false`, as long as its diagnostics state
    the alarm. Without diagnostics nobody knows whether the alarm goes on."""
    if history.again:
        return KEPT
    against = history.against_at
    if history.new and history.raised and 0.0 <= against < history.stated_at - TOLD_S:
        return (
            f"another node sent `false` {history.now - against:.1f} s ago, so robots drive during the"
            " alarm"
        )
    return None


def _told(history: AlarmHistory) -> Finding:
    hidden = history.hidden_at > history.quiet_at - TOLD_S  # perhaps the node's own `true`
    if not (history.new and history.rose) or (history.told is None and hidden):
        return None
    if history.told is not None:
        return KEPT
    text = f"its diagnostics state {history.stated}, but it has published no `true`"
    return Doubt(text, lambda: history.told is not None or not history.raised, TOLD_S)


def _ends(history: AlarmHistory) -> Finding:
    if not history.new or history.stated != "quiet" or history.told_at < 0.0:
        return None
    if history.ended_at >= history.told_at:
        return KEPT if history.stated_before not in ("", "quiet") else None
    text = (
        "its diagnostics state quiet, but nobody has published `false` since its `true`, so robots"
        " stand for ever"
    )
    return Doubt(text, lambda: _is_ended(history), TOLD_S)


def _is_ended(history: AlarmHistory) -> bool:
    return history.stated != "quiet" or max(history.ended_at, history.hidden_at) >= history.told_at


def _retained(history: AlarmHistory) -> Finding:
    if history.volatile is None:
        return None
    return (
        "its publisher is volatile, so fleet adapters do not receive its messages"
        if history.volatile
        else KEPT
    )


LAWS: Final[tuple[Law[AlarmHistory], ...]] = (
    Law(
        "A1.false",
        "A node publishes `false` only to end its own alarm",
        "a `false` of the node after its `true`",
        "One `false` ends every node's alarm, and the robots go on with their tasks",
        f"octarobotics/lci-rmf-adapter; {HANDLES}",
        _no_false,
    ),
    Law(
        "A1.others",
        "No `false` while the alarm of another node stands",
        "a `false` of the node, on a graph with another node's alarms",
        "Fleet adapters resume at any `false`. The robots drive although the other alarm goes on",
        f"{HANDLES}; open-rmf/rmf-web#129",
        _others,
    ),
    Law(
        "A1.fleets",
        "A `false` names every fleet that the node's `true` has named",
        "a `false` of the node after its `true`",
        "A fleet that the `false` leaves out stands for ever",
        "EmergencySignal.msg, fleet_names",
        _same_fleets,
    ),
    Law(
        "A2.told",
        "A node whose diagnostics state an alarm or a drill has published `true`",
        "the node's diagnostics change from `quiet` to an alarm",
        "Robots obey messages. An alarm that only /diagnostics state stops no robot",
        HANDLES,
        _told,
    ),
    Law(
        "A2.again",
        "A node repeats its `true` after another node's `false`, as long as its alarm lasts",
        "another node's `false` while the node's diagnostics state an alarm",
        "Otherwise the robots obey the `false`, and drive during the alarm",
        HANDLES,
        _again,
    ),
    Law(
        "A2.ends",
        "When the diagnostics state that an alarm is over, a `false` has been published",
        "the node's diagnostics state `quiet` after its `true`",
        "Without a `false` the robots stand for ever",
        HANDLES,
        _ends,
    ),
    Law(
        "A3.retained",
        "The alarm is published TRANSIENT_LOCAL",
        "a publisher of fire_alarm_trigger or emergency_signal",
        "Fleet adapters subscribe transient-local. A volatile publisher never reaches them",
        "rmf_ros2#341, agv/Node.cpp:73-79",
        _retained,
    ),
)
