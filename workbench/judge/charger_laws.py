"""The laws of a charger's node.

No part of RMF sends ChargerRequest. Therefore these laws follow from the comments in the message files,
and from what robots and coordinators need.
"""

from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.stamps import in_seconds
from workbench.judge.charger_history import (
    ASSIGNED,
    CHARGING,
    ERROR,
    IDLE,
    RELEASED,
    ChargerHistory,
    unrequested,
)
from workbench.judge.history import NOT_YET
from workbench.judge.law import KEPT, Doubt, Finding, Law, shown
from workbench.judge.shared_laws import ANSWERED, ONE, RATE, STAMP, fresh, named, stamped

LATE_S: Final = 10.0
SEEN_S: Final = 1.0
"""Maximum delay (s) from the beginning of ASSIGNED to the state that shows it."""
ENDS_WITHIN_S: Final[dict[int, float]] = {int(ASSIGNED): 5.0, int(CHARGING): 120.0}
"""State -> maximum time (s) for which a station may go on to serve a cancelled request. A charger needs
up to 120 s to reduce its current."""
FOREIGN_S: Final = 2.0
UNREACHED_S: Final = 15.0
_NUMBERS: Final = frozenset(d.ChargerStateValue)


def _numbers(history: ChargerHistory) -> Finding:
    if history.new is None:
        return None
    known = history.new.state in _NUMBERS
    return KEPT if known else f"state {history.new.state}: RMF has no such number"


def _known(history: ChargerHistory) -> d.ChargerState | None:
    """Return the new state if RMF defines the state's number. Otherwise return None."""
    state = history.new
    return state if state is not None and state.state in _NUMBERS else None


def _has_id(history: ChargerHistory) -> Finding:
    state = _known(history)
    if state is None or state.state == IDLE:
        return None
    return KEPT if state.request_id else f"no request_id: {words.described(state)}"


def _has_text(history: ChargerHistory) -> Finding:
    state = _known(history)
    if state is None:
        return None
    if (state.state == ERROR) == bool(state.error_message.strip()):
        return KEPT
    if state.state == ERROR:
        return "ERROR, and error_message is blank"
    word = words.word(d.ChargerStateValue, state.state)
    return f"{word}, and error_message is {shown(state.error_message)}"


def _same_robot(history: ChargerHistory) -> Finding:
    state = _known(history)
    if state is None or state.state == IDLE:
        return None
    asked = history.requests.get(state.request_id)
    if asked is None and state.request_id not in history.elsewhere:
        return None
    if asked is not None and _is_of(state, asked):
        return KEPT
    whose = (
        f"request {shown(asked.request_id)} is for {shown(f'{asked.fleet_name}/{asked.robot_name}')}"
        if asked
        else "the request is for another station"
    )

    def excused() -> bool:
        later = history.requests.get(state.request_id)
        return later is not None and _is_of(state, later)

    return Doubt(f"{whose}: {words.described(state)}", excused)


def _is_of(state: d.ChargerState, request: d.ChargerRequest) -> bool:
    return _robot(state) == (request.fleet_name, request.robot_name)


def _keeps(history: ChargerHistory) -> Finding:
    """Check that a station serves one request until that request ends.

    Three changes are allowed. First, the charge that nobody requested may become the charge of the
    robot on the pad. Second, a restarted node may have forgotten the request that it served. Third, a
    robot may leave the pad between two states, and the free station may then be ASSIGNED.
    """
    state, before = history.new, history.before
    if state is None or before is None or not {state.state, before.state} <= ENDS_WITHIN_S.keys():
        return None
    if state.request_id == before.request_id:
        return KEPT if history.was_tested(history.second_at) else None
    if unrequested(state.request_id) or not before.request_id or _is_over(history, before):
        return None
    on_pad = before.state == CHARGING or unrequested(before.request_id)
    if (on_pad and state.state == ASSIGNED) or not history.requests:
        return None
    if unrequested(before.request_id) and before.robot_name and _robot(before) == _robot(state):
        return None
    text = f"the station was {_whose(before)}, and now is {_whose(state)}"
    return Doubt(text, lambda: before.request_id in history.cancels)


def _is_over(history: ChargerHistory, before: d.ChargerState) -> bool:
    """Return whether the request in the state `before` may have ended before the new state. A cancel or
    the start_timeout may have ended it."""
    mine = before.request_id
    if unrequested(mine) or mine in history.cancels:
        return not unrequested(mine)
    if before.state != ASSIGNED:
        return False
    since = history.first_asked.get(mine)
    return since is None or _overdue_s(history, before, since) > -SEEN_S


def _overdue_s(history: ChargerHistory, state: d.ChargerState, since: float) -> float:
    """Return for how long (s) the start_timeout has been over, if the assignment began at `since`. The
    result is negative as long as the start_timeout runs, and if there is no start_timeout."""
    asked = history.requests.get(state.request_id)
    limit_s = in_seconds(asked.start_timeout) if asked else 0.0
    return history.now - since - limit_s if limit_s > 0.0 else NOT_YET


def _robot(state: d.ChargerState) -> tuple[str, str]:
    return state.robot_fleet, state.robot_name


def _whose(state: d.ChargerState) -> str:
    return f"{shown(state.request_id)} of {shown('/'.join(_robot(state)))}"


def _starts_in_time(history: ChargerHistory) -> Finding:
    state, before = history.new, history.before
    if state is None:
        return None
    if state.state != ASSIGNED:
        ended = before is not None and before.state == ASSIGNED and state.state in (IDLE, RELEASED)
        if before is None or not ended or before.request_id in history.cancels:
            return None
        return KEPT if _overdue_s(history, before, history.same_before) > -SEEN_S else None
    if _overdue_s(history, state, history.same_since) <= LATE_S:
        return None
    return f"still assigned to {shown(state.robot_name)} after {history.now - history.same_since:.0f} s"


def _cancels(history: ChargerHistory) -> Finding:
    state, before = history.new, history.before
    if state is None:
        return None
    at, limit_s = history.cancels.get(state.request_id), ENDS_WITHIN_S.get(state.state)
    if at is None or limit_s is None:
        served = before is not None and before.state in ENDS_WITHIN_S
        return KEPT if before and served and before.request_id in history.cancels else None
    if history.now - at <= limit_s:
        return None
    return (
        f"{words.described(state)} {history.now - at:.0f} s after the ChargerCancel of this request"
    )


def _foreign_cancel(history: ChargerHistory) -> Finding:
    state, before = history.new, history.before
    if state is None or before is None or before.state != ASSIGNED or not before.request_id:
        return None
    if unrequested(before.request_id):
        return None  # nobody cancels an unrequested charge: it ends when the robot leaves
    if history.now - history.foreign_at > FOREIGN_S:
        return None
    if state.state not in (IDLE, RELEASED):
        return KEPT
    if _is_over(history, before):
        return None
    mine = before.request_id
    text = f"the ChargerCancel of another request ended {shown(mine)}"
    return Doubt(text, lambda: mine in history.cancels)


CHARGER_STATE: Final = "ChargerState.msg"

LAWS: Final[tuple[Law[ChargerHistory], ...]] = (
    named(
        RATE,
        "C4.rate",
        reason="A coordinator chooses stations by their latest states. It cannot use a silent station",
        source="ChargerState.msg, charger_time",
    ),
    named(
        ANSWERED,
        "C4.answer",
        reason="If states answered requests, a node that sends a request after each state would"
        " never stop",
        source="as for lifts: rmf_ros2 agv/RobotContext.cpp:1732-1735",
    ),
    named(ONE, "B0.one"),
    named(STAMP, "C4.stamp", check=stamped(lambda state: state.state == ERROR)),
    Law(
        "C1.numbers",
        "state is a number of ChargerState.msg: 1, 2, 3, 4 or 200",
        "a state",
        "A vendor's codes mean something else. For example, Xnergy's code 3 is a handshake, and RMF"
        " would read 3 as CHARGING",
        CHARGER_STATE,
        _numbers,
    ),
    Law(
        "C5.id",
        "request_id is set in every state but IDLE",
        "a state other than IDLE",
        "request_id tells which request has the station",
        CHARGER_STATE,
        _has_id,
    ),
    Law(
        "C5.robot",
        "robot_fleet and robot_name are those of the request, and the request is for this station",
        "a request is served",
        "Otherwise two robots would believe that the station is theirs",
        CHARGER_STATE,
        _same_robot,
    ),
    Law(
        "C5.text",
        "In ERROR, error_message says what is wrong. In other states error_message is blank",
        "a state",
        "A technician reads only error_message",
        CHARGER_STATE,
        _has_text,
    ),
    Law(
        "C1.keeps",
        "While a station is ASSIGNED or CHARGING, its request_id does not change; only a charge that"
        " nobody requested (`unrequested/…`) may get the request_id of the robot on the pad, and only"
        " a robot that leaves the pad may free the station for the next ASSIGNED",
        "a second request while the first is served",
        "The next robot's request must not take over a station that is promised to the first robot",
        "ChargerRequest.msg, request_id",
        _keeps,
    ),
    Law(
        "C2.start",
        "ASSIGNED ends when start_timeout is over",
        "no robot comes until start_timeout is over",
        "A robot that never comes would keep the station for ever",
        "ChargerRequest.msg, start_timeout",
        _starts_in_time,
    ),
    Law(
        "C3.cancel",
        "A ChargerCancel ends its request: at once if ASSIGNED, after the ramp-down if CHARGING",
        "a ChargerCancel of the request that is served",
        "The coordinator promises the station to the next robot",
        "ChargerCancel.msg",
        _cancels,
        sensed=True,
    ),
    Law(
        "C3.foreign",
        "A ChargerCancel of another request changes nothing",
        "a ChargerCancel of another request while a station is ASSIGNED",
        "Such a cancel comes late, or is for a request that is over",
        "ChargerCancel.msg",
        _foreign_cancel,
    ),
    Law(
        "C4.fresh",
        "A station that cannot be reached is shown as ERROR; in other states charger_time advances",
        "states other than ERROR for more than 15 s",
        "An old IDLE that is shown again sends a robot to a station that may be on fire",
        "ChargerState.msg, charger_time",
        fresh(UNREACHED_S),
        sensed=True,
    ),
)
