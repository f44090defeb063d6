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
    """Check that the node's `false` messages name all fleets of its alarm. A node may end its alarm
    fleet by fleet. Only its diagnostics show that the alarm is over, and that fleets are left out."""
    if history.said is not None:
        is_end = history.told_before is not None and history.told is None
        return KEPT if is_end else None
    if not _left_out(history):
        return None
    text = f"its diagnostics state quiet, but its `false` leaves {_names(history)} standing"
    return Doubt(text, lambda: _is_ended(history), TOLD_S)


def _left_out(history: AlarmHistory) -> bool:
    """Return whether the node states that its alarm is over, has sent `false`, and left out fleets."""
    is_over = history.new and history.stated == "quiet"
    return is_over and history.released_at > history.told_at and bool(history.unended)


def _names(history: AlarmHistory) -> str:
    return ", ".join(map(shown, sorted(history.unended or ())))


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
    """Check that an alarm of the diagnostics has been published. A `true` of an earlier alarm counts
    only as long as no `false` has ended it."""
    if not (history.new and history.rose):
        return None
    if _is_told(history):
        return KEPT
    if not history.hears or history.hidden_at > history.quiet_at - TOLD_S:
        return None  # the node's own `true` may be hidden
    text = f"its diagnostics state {history.stated}, but it has published no `true`"
    return Doubt(text, lambda: _is_told(history) or not history.raised, TOLD_S)


def _is_told(history: AlarmHistory) -> bool:
    is_new = history.told_at > max(history.quiet_at - TOLD_S, history.released_at)
    return is_new or history.unended is not None


def _ends(history: AlarmHistory) -> Finding:
    if not history.new or history.stated != "quiet" or history.told_at < 0.0:
        return None
    if history.unended is None:
        return KEPT if history.stated_before not in ("", "quiet") else None
    fleets = f" for {_names(history)}" if history.unended else ""
    text = (
        f"its diagnostics state quiet, but nobody has published `false`{fleets} since its `true`, so"
        " robots stand for ever"
    )
    return Doubt(text, lambda: _is_ended(history), TOLD_S)


def _is_ended(history: AlarmHistory) -> bool:
    unknown = history.is_vague or history.hidden_at >= history.told_at
    return history.stated != "quiet" or history.unended is None or unknown


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
        "The `false` messages of a node name every fleet that its `true` has named",
        "a `false` that ends the node's alarm, or diagnostics that state `quiet` after a `false`",
        "A fleet that the `false` leaves out stands for ever",
        "EmergencySignal.msg, fleet_names",
        _same_fleets,
    ),
    Law(
        "A2.told",
        "A node whose diagnostics state an alarm or a drill has published `true`",
        "the node's diagnostics change from `quiet` to an alarm; a recording needs an alarm message of"
        " the node",
        "Robots obey messages. An alarm that only /diagnostics state stops no robot",
        HANDLES,
        _told,
    ),
    Law(
        "A2.again",
        "A node repeats its `true` after another node's `false`, as long as its alarm lasts",
        "another node's `false` while the node's diagnostics state an alarm; both senders are known",
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
