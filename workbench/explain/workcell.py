"""Explain a workcell, which is a dispenser or an ingestor. The sentences tell which request waits, and
who must act next.

RMF's fleet adapter continues after a result SUCCESS. The adapter also continues if a request was
acknowledged, and a newer state no longer lists this request (rmf_ros2, DispenseItem.cpp and
IngestItem.cpp). The adapter has no time limit.
"""

from typing import Final

from bridges.observe.workcell import FINAL
from workbench.explain import answer as common
from workbench.explain import first_causes
from workbench.explain.answer import Answer
from workbench.explain.phrases import TimePhrases
from workbench.explain.workcell_facts import WorkcellFacts

STOPS: Final = (
    "MEMORY_LOST",
    "OUTCOME_UNKNOWN",
    "NOT_KEPT",
    "WORKCELL_HALTED",
    "WORKCELL_FAULT",
)
"""Faults because of which a workcell that can be read is OFFLINE, the most serious first."""
REPEAT: Final = "for RMF to repeat the request"
"""What the daemon says of a request that its fleet adapter has to send again (`report.py` of the
dispensers)."""
ENDS: Final = {
    "success": "It has succeeded: RMF goes on after the workcell's next state or result.",
    "failed": "It has failed: RMF ends the task.",
}


def answer(workcell: WorkcellFacts, clock: TimePhrases, around: common.OthersHeard) -> Answer:
    """Explain the workcell's state at the time of the last message."""
    if workcell.last_state is None:
        return common.unheard(workcell, around)
    stopped = common.stopped(workcell, around, clock)
    if stopped is not None:
        return stopped
    found = Answer(since=min([one.first.at for one in workcell.requesters], default=float("-inf")))
    found.say(f"{workcell.name} has been {workcell.mode.value} {clock.since(workcell.mode.since)}.")
    if old := common.old_reading(workcell, clock):
        found.say(old)
    _doubt(found, workcell, clock)
    states = f"{workcell.kind}_states"
    if not (
        first_causes.two_nodes(found, workcell, clock, around, states)
        or first_causes.own_fault(found, workcell, clock, around)
    ):
        _next(found, workcell, clock, around)
    return found


def _doubt(found: Answer, workcell: WorkcellFacts, clock: TimePhrases) -> None:
    """Say that an offline workcell has not answered a request. The outcome stays in doubt, because
    neither a repeat nor a restart answers the request."""
    for wait in workcell.waits(clock.now):
        if workcell.mode.value == "offline" and wait.who not in workcell.results:
            found.say(f"Request {wait.who} has had no answer, and RMF repeats it without end.")


def _next(
    found: Answer, workcell: WorkcellFacts, clock: TimePhrases, around: common.OthersHeard
) -> None:
    asks = [one for one in workcell.requesters if one.asks(clock.now)]
    if not asks:
        _unasked(found, workcell, clock, around)
        return
    waits = [one for one in asks if workcell.results.get(one.who) not in FINAL]
    first = (waits or asks)[0]
    said = f"Request {first.who} has asked for {first.wants} {clock.since(first.since)}."
    if not waits:
        ended = (
            f"Request {first.who} for {first.wants} is over. {ENDS[workcell.results[first.who]]}"
        )
        found.say(ended, "the fleet adapter", "go on")
    elif workcell.mode.value == "offline":
        found.say(said)
        if not first_causes.own_fault(found, workcell, clock, around, codes=STOPS):
            found.acts("a person", "find out why the workcell is offline")
    elif workcell.mode.value == "busy":
        found.say(said, "the controller", "finish its cycle")
    elif workcell.lists(first.who):
        why = "" if workcell.waits_said(clock.now) else "; why it is not ready is not known"
        found.say(said, "the controller", f"become ready{why}")
    else:
        found.say(said, "the device's node", "list the request, and acknowledge it")


def _unasked(
    found: Answer, workcell: WorkcellFacts, clock: TimePhrases, around: common.OthersHeard
) -> None:
    """Explain a workcell for which no request comes. A request that the state lists may have been
    repeated before we listened, or on a topic that was not recorded."""
    queue, text = workcell.queue.value, "Nobody requests the workcell."
    heard = [one.who for one in workcell.requesters if workcell.lists(one.who)]
    waits = workcell.waits_said(clock.now).values()
    if queue and len(heard) == len(queue.split(", ")):
        text += f" Its state still lists {queue}, but no fleet adapter repeats it."
    elif queue:
        text = (
            f"The workcell's state lists {queue}, and no such request was heard. Whether a fleet"
            " adapter still waits is not known: requests may not have been recorded."
        )
    found.say(text)
    if first_causes.own_fault(found, workcell, clock, around, codes=STOPS):
        return
    if workcell.mode.value == "busy":
        found.acts("the controller", "finish its cycle")
    elif workcell.mode.value == "offline":
        found.acts("a person", "find out why the workcell is offline")
    elif queue and not heard and workcell.own(clock.now) is None:
        found.acts("a person", "find out why the workcell does not serve what it lists")
    elif REPEAT in waits:
        found.acts("the fleet adapter", "repeat the request")
    elif waits:
        found.acts("the controller", "become ready")
    elif queue and not heard:
        found.say("Its daemon says that nothing waits: the listed request has had its result.")
        found.acts("nobody", "there is nothing to do")
    else:
        found.acts("nobody", "there is nothing to do")
