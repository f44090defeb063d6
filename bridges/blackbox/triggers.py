"""Finds the reasons for a recording in a daemon's entries. The functions of this file are pure. The
reasons are:

- A fault appears. A hazard is a fault too, because it takes the device away from RMF.
- The daemon refuses a request. Refusals at a normal handover or at a start do not count. The refusal
  of an operator's reset does not count either, because the command tells the operator why.
- A request has waited longer than `waiting_s`.
- The daemon reports that a defect in its program ends it.

A reason does not count if the same reason came for the same subject within the last AGAIN_S.
"""

from collections.abc import Iterator, Sequence
from typing import Final

from bridges.blackbox.entries import (
    AnyEntry,
    DaemonDied,
    DaemonEnded,
    Decided,
    Known,
    Spoken,
    SubjectForgotten,
)
from bridges.blackbox.incident import Note
from bridges.blackbox.value_codec import Tree, tree
from bridges.kinds.shared.decision import EXPECTED, Fault, OperatorReset
from bridges.kinds.shared.durations import AGES_AGO
from bridges.messages import cdr
from bridges.messages.heard import Heard
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import MESSAGES
from bridges.observe.all_devices import PlainGraph
from bridges.observe.tally import SiteTally

AGAIN_S: Final = 600.0
MOST_NOTED: Final = 1000
RESET: Final = tree(OperatorReset())

FAULT, REFUSED, WAITING, DIED, OPERATOR = "FAULT", "REFUSED", "WAITING", "DIED", "OPERATOR"


def death(entries: Sequence[AnyEntry]) -> Note | None:
    """Return the reason to record a run that did not shut down cleanly. Return None for a run without
    a decision, because the log explains a failed start."""
    if not any(isinstance(entry, Decided) for entry in entries):
        return None
    told = [entry.reason for entry in entries if isinstance(entry, DaemonDied)]
    last = entries[-1]
    if isinstance(last, DaemonEnded):
        off = "every output" if last.safe else "not every output"
        told.append(f"the daemon ended, and {off} was verified off")
    told.append("the daemon left no last entry: it was killed, or the machine stopped")
    return Note(last.at, DIED, told[0])


class Triggers:
    """The finder of reasons to record one run of a daemon.

    `waiting_s`: a requester that waits this long (s) is a reason for a recording. `tally` counts the
    actions of the devices, such as rides, from the messages.
    """

    def __init__(self, waiting_s: float) -> None:
        self._faults: dict[str, set[str]] = {}
        self._noted: dict[tuple[str, str, str], float] = {}
        self._waiting_s = waiting_s
        self._graph = PlainGraph()
        self.tally = SiteTally()

    def take(self, entry: AnyEntry) -> list[Note]:
        """Return the reasons for a recording that this entry gives, and that did not come lately."""
        return [note for note in self._all(entry) if self._is_new(note)]

    def _all(self, entry: AnyEntry) -> Iterator[Note]:
        if isinstance(entry, Decided):
            yield from self._step(entry)
        elif isinstance(entry, Known):
            report = entry.report if isinstance(entry.report, dict) else {}
            self._faults[entry.subject] = set(_codes(report.get("faults")))
        elif isinstance(entry, SubjectForgotten):
            self._faults.pop(entry.subject, None)
        elif isinstance(entry, DaemonDied):
            yield Note(entry.at, DIED, entry.reason)
        elif isinstance(entry, Spoken):
            yield from self._spoken(entry)

    def _step(self, step: Decided) -> Iterator[Note]:
        for faults in step.faults:
            codes, before = _codes(faults), self._faults.get(step.subject, set())
            for code, detail in codes.items():
                if code not in before:
                    yield Note(step.at, FAULT, str(Fault(code, detail)), step.subject)
            self._faults[step.subject] = set(codes)
        expected = step.refused.partition(": ")[0] in EXPECTED or step.event == RESET
        if step.refused and not expected:
            yield Note(step.at, REFUSED, step.refused, step.subject)

    def _spoken(self, spoken: Spoken) -> Iterator[Note]:
        """Yield a note for each requester that has waited too long. The decisions do not show who
        waits, so this function reads the messages."""
        kind, release = MESSAGES.get(spoken.type), RELEASES.get(spoken.release)
        if kind is None or release is None:
            return
        try:
            message = cdr.decode(kind, spoken.cdr, release)
        except cdr.CdrError:
            return
        found = self._graph.hear(Heard(spoken.at, spoken.at, spoken.topic, message))
        self.tally.take(self._graph, found)
        for device, _ in found:
            for wait in device.waits(self._graph.now):
                for_s = spoken.at - wait.since.at
                if for_s >= self._waiting_s:
                    text = f"{wait.who} has waited for {wait.wants} for {for_s:.0f} s"
                    yield Note(spoken.at, WAITING, text, device.id)

    def _is_new(self, note: Note) -> bool:
        what = note.text.rpartition(" for ") if note.code == WAITING else note.text.partition(":")
        key = (note.code, note.subject, what[0])
        last = self._noted.get(key, AGES_AGO)
        if note.at < last + AGAIN_S:
            return False
        if len(self._noted) > MOST_NOTED:
            self._noted.clear()
        self._noted[key] = note.at
        return True


def _codes(faults: Tree) -> dict[str, str]:
    """Return the details of the faults in a report, by code."""
    listed = faults if isinstance(faults, list) else []
    found = [fault for fault in listed if isinstance(fault, dict)]
    return {str(fault.get("code")): str(fault.get("detail", "")) for fault in found}
