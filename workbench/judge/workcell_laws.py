"""The laws of a dispenser's or ingestor's node. RMF decides from states and results whether a request
is complete."""

from functools import partial
from typing import Final

from bridges.messages import definitions as d
from bridges.messages import words
from workbench.judge.law import KEPT, Doubt, Finding, Law, shown
from workbench.judge.shared_laws import ONE, RATE, STAMP, named, stamped
from workbench.judge.workcell_history import HEARD_S, WorkcellHistory

ACKNOWLEDGED, SUCCESS, FAILED = d.WorkcellStatus
SOURCE: Final = "rmf_ros2 phases/DispenseItem.cpp, IngestItem.cpp (_get_status)"
REPEATS_S: Final = 5.0


def _numbers(history: WorkcellHistory) -> Finding:
    if history.new is not None:
        known = history.new.mode in list(d.WorkcellMode)
        return KEPT if known else f"mode {history.new.mode}: RMF has no such number"
    if history.result is None:
        return None
    known = history.result.status in list(d.WorkcellStatus)
    return KEPT if known else f"status {history.result.status}: RMF has no such number"


def _lists_first(history: WorkcellHistory) -> Finding:
    """Check that a state newer than an acknowledgement lists the acknowledged request.

    An older state is no breach, because RMF compares stamps and ignores this state. The breach may
    still be excused, because the network may have lost the first state that lists the request.
    """
    result, state = history.result, history.new
    if result is not None:
        acknowledged = result.status == ACKNOWLEDGED and result.request_guid in history.listed
        return KEPT if acknowledged else None
    for guid, at in history.acknowledged.items():
        if state is not None and words.stamped_at(state) >= at:
            text = f"request {shown(guid)} was acknowledged, and a newer state does not list it"
            return Doubt(text, partial(_excused, history, guid))
    return None


def _excused(history: WorkcellHistory, guid: str) -> bool:
    return guid not in history.acknowledged


def _leaves_done(history: WorkcellHistory) -> Finding:
    """Check that states stop listing a request only after its result SUCCESS.

    The message SUCCESS may get lost. Then RMF continues, and does not repeat the request, so that the
    node does not repeat SUCCESS. Therefore the first request without SUCCESS is no breach, but the
    second is. After a FAILED the first is a breach too. But if RMF has stopped repeating the request,
    its phase has ended, and the queue no longer matters. The law is kept only if, at the end of the
    judgement, every request that left had succeeded.
    """
    for guid in history.left:
        if not history.is_over(guid) and not _is_explained(history, guid):
            text = (
                f"request {shown(guid)} left the queue without SUCCESS, so RMF sends the robot on"
            )
            return Doubt(text, partial(_is_explained, history, guid))
    unknown = history.unexplained or history.vanished
    return KEPT if history.news is None and history.succeeded and not unknown else None


def _is_explained(history: WorkcellHistory, guid: str) -> bool:
    """Return whether the request has succeeded, or a single lost message SUCCESS explains that it has
    left the queue."""
    result = history.results.get(guid)
    return result == SUCCESS or (result != FAILED and len(history.unexplained) < 2)


def _keeps_result(history: WorkcellHistory) -> Finding:
    result, before = history.result, history.result_before
    if result is None or before not in (SUCCESS, FAILED):
        return None
    if result.status == before:
        return KEPT
    was, now = words.plain(d.WorkcellStatus, before), words.result(result)
    return f"the result of request {shown(result.request_guid)} was {was}, and now is {now}"


def _repeats(history: WorkcellHistory) -> Finding:
    """Check at each state that the node has answered the requests that came before. A node that is
    OFFLINE need not answer, because it may not know the outcome of the request."""
    if history.result is not None:
        again = history.came_again and history.result_before == history.result.status
        return KEPT if again else None
    for guid, status in history.results.items():
        if history.new is not None and history.waited_s(guid) > REPEATS_S:
            said = words.plain(d.WorkcellStatus, status)
            return f"request {shown(guid)} is {said}; RMF has repeated it for {REPEATS_S:g} s since"
    return None


LAWS: Final[tuple[Law[WorkcellHistory], ...]] = (
    Law(
        "W1.numbers",
        "Modes and results are numbers of RMF's messages",
        "a state or a result",
        "RMF ignores an unknown status, and the robot waits for ever",
        "DispenserState.msg, DispenserResult.msg",
        _numbers,
    ),
    Law(
        "W2.lists",
        "A state that is newer than a request's acknowledgement lists the request",
        "a result ACKNOWLEDGED for a listed request",
        "If a newer state does not list an acknowledged request, RMF counts the request as complete",
        SOURCE,
        _lists_first,
    ),
    Law(
        "W2.done",
        "A listed request leaves the queue only if the request has succeeded",
        "without a pause of the states, a newer state that no longer lists a request",
        "RMF counts a request that left the queue as complete, even if a FAILED comes with that state,"
        " and sends the robot off",
        SOURCE,
        _leaves_done,
    ),
    Law(
        "W3.result",
        "A result is final",
        "two results for one request, if the first is SUCCESS or FAILED; a guid that RMF requests again"
        f" after {HEARD_S:g} s names a new request",
        "RMF ends at the first result that it hears. Of two results, chance decides which comes first",
        SOURCE,
        _keeps_result,
    ),
    Law(
        "W3.repeats",
        "A node that is not OFFLINE repeats a result whenever the request comes again",
        "a request that comes again after its result",
        "RMF repeats a request until a result comes. If a lost result is not repeated, the robot"
        " waits for ever",
        "rmf_ros2 phases/DispenseItem.cpp, IngestItem.cpp (_init_obs)",
        _repeats,
    ),
    named(
        RATE,
        "W4.rate",
        reason="States tell RMF that a request is listed, and tell the page that the node lives",
        source=SOURCE,
    ),
    named(
        STAMP,
        "W4.stamp",
        reason="RMF ignores a state that is older than the last state or result",
        source="rmf_ros2 phases/Utils.cpp (is_newer)",
        check=stamped(lambda state: state.mode == d.WorkcellMode.OFFLINE),
    ),
    named(ONE, "B0.one"),
)
