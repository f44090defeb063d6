"""What is known of every kind of device: its states and their age, its daemons' faults, its story."""

import sys
from abc import abstractmethod
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from bridges.messages import definitions as d
from bridges.observe.device import News, ObservedDevice
from bridges.observe.limits import SILENT_S
from bridges.observe.requesters import Moment
from bridges.runtime import diagnostics
from workbench.explain.explanation import StoryLine
from workbench.explain.noted import Noted
from workbench.explain.phrases import lasted
from workbench.explain.rows import label

MOST_LINES: Final = 600
MOST_NODES: Final = 8
MOST_CODES: Final = 20
BACK_S: Final = 0.2
BACK_TIMES: Final = 3
BACK_WITHIN_S: Final = 15.0
"""Stamps that go back this far, this often within this time come from two nodes."""
REFUSED: Final = "refused "
QUIET_S: Final = 60.0
"""A refusal that comes again within this time is not reported again."""


@dataclass(slots=True)
class RefusalCount:
    """How often a node of ours has refused for one reason, and when it last did."""

    count: int
    last: Moment


@dataclass(slots=True)
class NodeDiagnosis:
    """What one node says of the device. `faults`: code -> (detail, since when)."""

    kind: str
    last: Moment
    values: Mapping[str, str] = field(default_factory=dict)
    faults: dict[str, tuple[str, Moment]] = field(default_factory=dict)
    refused: dict[str, RefusalCount] = field(default_factory=dict)


class Device(ObservedDevice[Any]):
    """One device as it was heard, and its story. `name`: its name as a text that can be shown. `focus`:
    a session whose last ride's story is kept whole, even if others ride after it."""

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.name = label(name)
        self.focus = ""
        self.lines: deque[StoryLine] = deque(maxlen=MOST_LINES)
        self.told = 0
        self.diagnoses: dict[str, NodeDiagnosis] = {}
        self.noted: NodeDiagnosis | None = None
        self.notes_faults = False

    def hear(self, moment: Moment, topic: str, message: d.Message) -> list[News]:
        """Take a message about it, and tell what it changed."""
        news = super().hear(moment, topic, message)
        for one in news:
            self.tell(one.at, self._reads(one) or self.says(one))
            self.notice(one)
        return news

    def text(self, name: str) -> str:
        """A name from the network, as it can be shown."""
        return label(name)

    @abstractmethod
    def says(self, one: News) -> str:
        """A line of the story; "" for none."""

    def notice(self, one: News) -> None:
        """Count what has been told."""

    def _reads(self, one: News) -> str:
        """What is told of every kind's states."""
        match one.what:
            case "first state":
                return f"the first state of {self.name} comes"
            case "states again":
                return f"states of {self.name} come again, after {lasted(one.gap_s)} without one"
            case "read" if one.text:
                return f"the reading behind the states {one.text}"
            case "read":
                return "the readings are fresh again"
        return ""

    def tell(self, moment: Moment, text: str) -> None:
        """A line of the story; none for ""."""
        if not text:
            return
        self.told += 1
        self.lines.append(StoryLine(moment.at, moment.wall, sys.intern(label(text, 200))))

    def lines_since(self, at: float) -> tuple[StoryLine, ...]:
        """The story from this time on."""
        return tuple(line for line in self.lines if line.at >= at)

    def two_nodes(self, now: Moment) -> bool:
        """Do the stamps go back and forth, as those of two nodes do?"""
        return self.steps_back(now.at, BACK_S, BACK_WITHIN_S) >= BACK_TIMES

    def diagnose(self, moment: Moment, status: d.DiagnosticStatus, kind: str) -> None:
        """What a daemon of ours says of it."""
        found = self.diagnoses.get(status.name)
        if found is None:
            if len(self.diagnoses) >= MOST_NODES:
                return
            first = Moment(moment.at, moment.wall, moment.at - self.began.at > SILENT_S)
            found = self.diagnoses[status.name] = NodeDiagnosis(kind, first)
            moment = first
        found.last = moment
        found.values = {pair.key: pair.value for pair in status.values}
        self._faults(found, moment, status)
        self._refusals(found, moment)

    def note(self, moment: Moment, note: Noted) -> None:
        """What its own daemon noted: it writes what changes, so each note holds until the next."""
        if self.noted is None:
            near = moment.at - self.began.at <= SILENT_S
            self.noted = NodeDiagnosis(self.kind, Moment(moment.at, moment.wall, seen=not near))
        known = self.noted
        if note.outputs is not None:
            on = [f"{label(name)} {label(value)}" for name, value in note.outputs.items() if value]
            known.values = {"outputs": ", ".join(on).replace(" on", " yes") or "-"}
        if note.faults is not None:
            self._set_faults(
                known,
                moment,
                {
                    label(code): "" if text == code else label(text)
                    for code, text in note.faults.items()
                },
            )
            self.notes_faults = True
        if note.refused:
            self._refuses(known, moment, label(note.refused.partition(": ")[0]))

    def _refuses(self, known: NodeDiagnosis, moment: Moment, reason: str) -> None:
        before = known.refused.get(reason)
        if before is None and len(known.refused) >= MOST_CODES:
            return
        if before is None or moment.at - before.last.at > QUIET_S:
            self.tell(moment, f"its daemon refuses a request: {reason}")
        known.refused[reason] = RefusalCount(before.count + 1 if before else 1, moment)

    def heard_from(self, now: Moment) -> Iterator[NodeDiagnosis]:
        """What daemons of ours say now, and what the device's own noted."""
        if self.noted is not None:
            yield self.noted
        yield from (one for one in self.diagnoses.values() if now.at - one.last.at <= SILENT_S)

    def own(self, now: Moment) -> NodeDiagnosis | None:
        """What the device's own daemon says now; None if that is not ours, or silent."""
        return next((one for one in self.heard_from(now) if one.kind == self.kind), None)

    def faults(self, now: Moment) -> dict[str, tuple[str, Moment]]:
        """Code -> detail, and since when; the device's own first."""
        found: dict[str, tuple[str, Moment]] = {}
        for one in sorted(self.heard_from(now), key=lambda one: one.kind != self.kind):
            for code, fault in one.faults.items():
                found.setdefault(code, fault)
        return found

    def waits_said(self, now: Moment) -> dict[str, str]:
        """What those wait for that ask our daemons for it, by the daemon's kind."""
        said = ((one.kind, one.values.get("waits")) for one in self.heard_from(now))
        return {kind: label(text, 200) for kind, text in said if text}

    def refusals(self, now: Moment, since: float) -> list[str]:
        """Why requests were refused since then (s), the last reason first."""
        found = [
            (refused.last.at, reason)
            for one in self.heard_from(now)
            for reason, refused in one.refused.items()
            if refused.last.seen and refused.last.at >= since
        ]
        return [reason for _, reason in sorted(found, reverse=True)]

    def _faults(self, found: NodeDiagnosis, moment: Moment, status: d.DiagnosticStatus) -> None:
        codes = {
            label(code): label(found.values.get(code, ""))
            for code in diagnostics.faults(status)[:MOST_CODES]
        }
        self._set_faults(found, moment, codes)

    def _of_its_own(self) -> Iterator[NodeDiagnosis]:
        """What its own daemon noted, and what it says on the graph."""
        if self.noted is not None:
            yield self.noted
        yield from (one for one in self.diagnoses.values() if one.kind == self.kind)

    def _set_faults(self, found: NodeDiagnosis, moment: Moment, codes: Mapping[str, str]) -> None:
        """Take its faults. A daemon notes a fault, and publishes it later: the story has it once."""
        repeated = self.notes_faults and found is not self.noted and found.kind == self.kind
        told = {code for one in self._of_its_own() for code in one.faults}
        for code in [code for code in found.faults if code not in codes]:
            del found.faults[code]
            if not repeated:
                self.tell(moment, f"fault {code} is over")
        for code, detail in codes.items():
            if not repeated and code not in found.faults and code not in told:
                self.tell(moment, f"fault {code}" + (f": {detail}" if detail else ""))
            found.faults[code] = detail, found.faults.get(code, ("", moment))[1]

    def _refusals(self, found: NodeDiagnosis, moment: Moment) -> None:
        for key, value in found.values.items():
            if not key.startswith(REFUSED) or not value.isdecimal() or len(value) > 18:
                continue
            reason, count = label(key.removeprefix(REFUSED)), int(value)
            before = found.refused.get(reason)
            if before is None:
                if len(found.refused) < MOST_CODES:
                    found.refused[reason] = RefusalCount(count, moment)
                    if moment.seen:
                        self.tell(moment, f"its daemon refuses a request: {reason}")
            elif count != before.count:
                if moment.at - before.last.at > QUIET_S:
                    self.tell(moment, f"its daemon refuses a request: {reason}")
                before.count, before.last = count, Moment(moment.at, moment.wall)
