"""What the log and the status file are told of one lift: who has it, who waits, what is wrong."""

from collections.abc import Iterable, Iterator
from typing import Final

import msgspec

from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits, SupervisedLift
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import SILENT_S
from bridges.messages.definitions import LiftMode

SILENT: Final = "LIFT_SILENT"
OVERDUE_S: Final = 30.0
"""A lift that has not obeyed for this long is at fault."""


class SupervisorReport(msgspec.Struct, frozen=True):
    """One lift, for the log and the status file. Times are monotonic seconds.

    `shown`: the session in the lift's state. `holder`: the session whose turn it is, `since` when.
    `ending`: we send its END. `waiting`: the queue, with the time of each first request. `read_at`:
    when the lift's last state came. `waits`: what those wait for that ask and are not served.
    """

    read_at: float | None
    shown: str = ""
    holder: str = ""
    since: float = 0.0
    ending: bool = False
    waiting: tuple[tuple[str, float], ...] = ()
    faults: tuple[Fault, ...] = ()
    waits: str = ""

    def news(self) -> object:
        """What is worth a line in the log."""
        return self.shown, self.holder, self.ending, tuple(session for session, _ in self.waiting)


def report(memory: SupervisedLift, faults: Iterable[Fault]) -> SupervisorReport:
    """The lift as it is now, with these faults."""
    turn, faults = memory.turn, tuple(faults)
    waiting = tuple(
        (claim.session, claim.since)
        for claim in memory.claims
        if turn is None or turn.ends or claim.session != turn.session
    )
    return SupervisorReport(
        read_at=None if memory.shown is None else memory.shown_at,
        shown=memory.session_shown,
        holder=turn.session if turn else "",
        since=turn.since if turn else 0.0,
        ending=bool(turn and turn.ends),
        waiting=waiting,
        faults=faults,
        waits=_waits(memory, faults, queued=bool(waiting)),
    )


def _waits(memory: SupervisedLift, faults: tuple[Fault, ...], *, queued: bool) -> str:
    """What the first in the queue waits for; without a queue, the one whose turn it is."""
    turn, shown = memory.turn, memory.session_shown
    if not memory.claims:
        return ""
    if not memory.may_speak:
        return memory.passive
    if any(fault.code == SILENT for fault in faults):
        return "for the lift's states"
    if turn and turn.ends:
        return f"for the lift to release {turn.session}"
    if shown and (turn is None or turn.session != shown):
        return f"for a request or the end of {shown}, which the lift shows"
    if memory.shown and memory.nobody_is_sent:
        mode = LiftMode(memory.shown.mode).name.removeprefix("MODE_")
        return f"for the end of the lift's {mode} mode"
    if turn and not shown:
        return f"for the lift to take {turn.session}"
    return f"for END of {turn.session}" if turn and queued else ""


def alarms(
    memory: SupervisedLift, now: float, limits: LiftSupervisorLimits
) -> Iterator[tuple[float, Fault]]:
    """Each fault that may come, and when it will if nothing changes."""
    turn = memory.turn
    if not memory.flows(now):
        if turn or memory.claims:
            yield memory.shown_at + SILENT_S, Fault(SILENT, "no LiftState comes")
        return
    if turn is None:
        return
    overdue_at = turn.since + OVERDUE_S
    if turn.ends:
        yield overdue_at, Fault("END_NOT_OBEYED", f"the lift does not release {turn.session}")
        return
    if not turn.seen and not memory.nobody_is_sent:
        yield overdue_at, Fault("NOT_GRANTED", f"the lift does not take {turn.session}")
    claim = memory.claim(turn.session)
    assert claim is not None
    silent_at = memory.gone_at(claim, now, limits.holder_alarm_s)
    yield silent_at, Fault("HOLDER_SILENT", f"no request from {turn.session}")
