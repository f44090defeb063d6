"""The laws of a node that tells the fleets of an alarm. RMF's fleet adapters obey the last word of any
node: a `true` stops their robots, and any `false` lets the robots drive."""

from typing import Final

from workbench.judge.alarm_history import AlarmHistory
from workbench.judge.history import NOT_YET
from workbench.judge.law import KEPT, Doubt, Finding, Law, shown

HANDLES: Final = "rmf_ros2 FleetUpdateHandle::handle_emergency"
ALARMS_END_S: Final = 3.0
"""The longest time (s) between the `false` messages of nodes that end one alarm together."""
FALSES: Final = 3
"""The number of needless `false` in a row that no missed `true` can explain."""
TOLD_S: Final = 2.0
"""The longest time (s) between a statement and its message, and from a `false` to the next `true`.
Statements come each second."""


def _is_false(history: AlarmHistory) -> bool:
    return history.said is not None and not history.said.on


def _no_false(history: AlarmHistory) -> Finding:
    """Check that a `false` ends a `true` of the node. A first `true` may have been missed."""
    if not _is_false(history):
        return None
    if history.needless >= FALSES:
        return f"`false` {FALSES} times, with no alarm of its own to call off"
    return None if history.needless else KEPT


def _others(history: AlarmHistory) -> Finding:
    """Check that the node ends no other node's alarm. Several nodes may end one alarm together."""
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
    """Check that the node repeats `true` as long as it states its alarm. Without statements it is
    unknown whether the alarm goes on."""
    if history.again:
        return KEPT
    against = history.against_at
    if history.new and history.raised and 0.0 <= against < history.stated_at - TOLD_S:
        return f"another node's `false` was {history.now - against:.1f} s ago: robots drive"
    return None


def _told(history: AlarmHistory) -> Finding:
    hidden = history.hidden_at > history.quiet_at - TOLD_S  # perhaps the node's own `true`
    if not (history.new and history.rose) or (history.told is None and hidden):
        return None
    if history.told is not None:
        return KEPT
    text = f"it states {history.stated}, and has published no `true`"
    return Doubt(text, lambda: history.told is not None or not history.raised, TOLD_S)


def _ends(history: AlarmHistory) -> Finding:
    if not history.new or history.stated != "quiet" or history.told_at < 0.0:
        return None
    if history.ended_at >= history.told_at:
        return KEPT if history.stated_before not in ("", "quiet") else None
    text = (
        "it states quiet, and nobody has published `false` since its `true`: robots stand for ever"
    )
    return Doubt(text, lambda: _is_ended(history), TOLD_S)


def _is_ended(history: AlarmHistory) -> bool:
    return history.stated != "quiet" or max(history.ended_at, history.hidden_at) >= history.told_at


def _retained(history: AlarmHistory) -> Finding:
    if history.volatile is None:
        return None
    return "its publisher is volatile: fleet adapters do not match it" if history.volatile else KEPT


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
        "A node that states an alarm or a drill has published `true`",
        "a node's statement of an alarm, after the statement `quiet`",
        "Robots obey messages. A statement on /diagnostics stops no robot",
        HANDLES,
        _told,
    ),
    Law(
        "A2.again",
        "A raised alarm is published again after another node's `false`",
        "another node's `false` during the node's stated alarm",
        "The robots have obeyed the `false`, and drive during the alarm",
        HANDLES,
        _again,
    ),
    Law(
        "A2.ends",
        "An alarm that is stated as over was called off by a `false`",
        "a statement `quiet` after the node's `true`",
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
