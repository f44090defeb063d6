"""One lift's report to the log and the status file: its holder, its queue, its faults."""

from collections.abc import Iterable, Iterator
from typing import Final

import msgspec

from bridges.kinds.lift_supervisor.memory import LiftSupervisorLimits, SupervisedLift
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import SILENT_S
from bridges.messages.definitions import LiftMode

SILENT: Final = "LIFT_SILENT"
OVERDUE_S: Final = 30.0
"""The time (s) within which a lift must take or release a session. After that a fault is shown."""


class SupervisorReport(msgspec.Struct, frozen=True):
    """One lift, for the log and the status file. Times are monotonic seconds.

    `shown`: the session in the lift's state. `holder`: the session whose turn began at `since`.
    `ending`: we send the holder's END. `waiting`: the queue, as pairs of a session and the time of its
    first request. `read_at`: the time of the lift's last state. `waits`: the reason why the requesters
    still wait.
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
        """Return the facts whose change is logged."""
        return self.shown, self.holder, self.ending, tuple(session for session, _ in self.waiting)


def report(memory: SupervisedLift, faults: Iterable[Fault]) -> SupervisorReport:
    """Report the present state of the lift, with these faults."""
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
    """Return the reason why the first session in the queue waits. Without a queue, return the reason
    why the session that has its turn waits."""
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
        return f"for a request or the END of {shown}, because the lift shows it"
    if memory.shown and memory.nobody_is_sent:
        mode = LiftMode(memory.shown.mode).name.removeprefix("MODE_")
        return f"for the end of the lift's {mode} mode"
    if turn and not shown:
        return f"for the lift to take {turn.session}"
    return f"for END of {turn.session}" if turn and queued else ""


def alarms(
    memory: SupervisedLift, now: float, limits: LiftSupervisorLimits
) -> Iterator[tuple[float, Fault]]:
    """Yield pairs of a time and a fault. If nothing changes, the fault begins at that time."""
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
