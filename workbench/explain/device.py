"""Facts that all kinds of device share: states and their age, faults that daemons report, and the
device's story (one text line for each event)."""

import sys
from abc import abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Any, Final

from bridges.messages import definitions as d
from bridges.observe.device import ObservedDevice
from bridges.observe.diagnosis import Diagnosis
from bridges.observe.limits import SILENT_S
from bridges.observe.news import News
from bridges.observe.requesters import Moment
from workbench.explain.explanation import StoryLine
from workbench.explain.noted import Noted
from workbench.explain.phrases import lasted
from workbench.explain.rows import label

MOST_LINES: Final = 600
DAEMON_REFUSES: Final = "its daemon refuses a request: "
LONGEST_DETAIL: Final = 300
"""Maximum length (characters) of a fault's detail. The details of HTTP drivers contain an address and a
reason."""
BACK_S: Final = 0.2
BACK_TIMES: Final = 3
BACK_WITHIN_S: Final = 15.0
"""BACK_S, BACK_TIMES and BACK_WITHIN_S tell when stamps prove that two nodes publish the same device.

With two publishers, stamps jump back again and again. The proof is BACK_TIMES jumps of at least BACK_S
(s) within BACK_WITHIN_S (s).
"""


class Device(ObservedDevice[Any]):
    """One device, built from its messages, and its story.

    - `name`: the device's name in a printable form.
    - `focus`: the session that the user asked about. The story keeps every line of this session's last
      ride, even if other sessions ride later.
    - `bus_error`: the last bus error that the device's daemon wrote into the recording.
    """

    def __init__(self, name: str, began: Moment) -> None:
        super().__init__(name, began)
        self.name = label(name)
        self.focus = ""
        self.lines: deque[StoryLine] = deque(maxlen=MOST_LINES)
        self.noted: Diagnosis | None = None
        self.notes_faults = False
        self.bus_error = ""

    def hear(self, moment: Moment, topic: str, message: d.Message) -> list[News]:
        """Take a message about the device, and add the changes to the story."""
        return self._tell_all(super().hear(moment, topic, message))

    def diagnose(self, moment: Moment, status: d.DiagnosticStatus) -> list[News]:
        """Take our daemon's diagnostics about the device, and add the changes to the story."""
        return self._tell_all(super().diagnose(moment, status))

    def _tell_all(self, news: Iterable[News]) -> list[News]:
        told = [*news]
        for one in told:
            self.tell(one.at, self._reads(one) or self.says(one))
            self.notice(one)
        return told

    def text(self, name: str) -> str:
        """Return a name from the network in a printable form."""
        return label(name)

    def sentence(self, text: str) -> str:
        """Return a sentence from the network in a printable form."""
        return label(text, LONGEST_DETAIL)

    @abstractmethod
    def says(self, one: News) -> str:
        """Return a line of the story. Return "" if the story leaves the event out."""

    def notice(self, one: News) -> None:
        """Count the events that the story tells."""

    def _reads(self, one: News) -> str:
        """Return the story line for an event that all kinds of device have."""
        match one.what:
            case "first state":
                return f"the first state of {self.name} comes"
            case "states again":
                return f"states of {self.name} come again, after {lasted(one.gap_s)} without one"
            case "read" if one.text:
                return f"the reading in the device's states {one.text}"
            case "read":
                return "the readings are fresh again"
            case "refused":
                return DAEMON_REFUSES + one.text
            case "fault" | "fault over":
                return self._fault(one)
        return ""

    def tell(self, moment: Moment, text: str) -> None:
        """Add a line to the story. An empty text adds no line."""
        if not text:
            return
        self.lines.append(StoryLine(moment.at, moment.wall, sys.intern(label(text, 200))))

    def lines_since(self, at: float) -> tuple[StoryLine, ...]:
        """Return the story from time `at` (s) on."""
        return tuple(line for line in self.lines if line.at >= at)

    def two_nodes(self, now: Moment) -> bool:
        """Return whether two nodes publish this device's states. The signs are states from two
        publishers, or stamps that jump back and forth."""
        return (
            len(self.publishers(now)) > 1
            or self.steps_back(now.at, BACK_S, BACK_WITHIN_S) >= BACK_TIMES
        )

    def nodes(self, now: Moment) -> list[str]:
        """Name the nodes that publish the device's states now. Leave out unknown nodes."""
        if len(senders := {label(one.node) for one in self.publishers(now) if one.node}) > 1:
            return sorted(senders)
        every = (one for one in self.diagnoses.values() if one.is_current(now.at))
        return sorted({one.name.partition(": ")[0] for one in every if one.kind == self.kind})

    def note(self, moment: Moment, note: Noted) -> None:
        """Take an entry that the device's own daemon wrote into the recording. The daemon writes only
        changes, so a value holds until the next entry."""
        if self.noted is None:
            near = moment.at - self.began.at <= SILENT_S
            self.noted = Diagnosis(self.kind, Moment(moment.at, moment.wall, seen=not near))
        known = self.noted
        if note.outputs is not None:
            on = [f"{label(name)} {label(value)}" for name, value in note.outputs.items() if value]
            known.values = {"outputs": ", ".join(on).replace(" on", " yes") or "-"}
        if note.faults is not None:
            found = note.faults.items()
            told = ((label(c), "" if text == c else self.sentence(text)) for c, text in found)
            self._tell_all(known.has(moment, dict(told)))
            self.notes_faults = True
        self.bus_error = label(note.bus_error, 200) or self.bus_error
        if note.refused:
            self._tell_all(known.refuses(moment, label(note.refused.partition(": ")[0])))

    def _daemons(self) -> Iterator[Diagnosis]:
        """Yield first what the device's own daemon wrote into the recording. Then yield the diagnostics
        of all our daemons."""
        if self.noted is not None:
            yield self.noted
        yield from self.diagnoses.values()

    def heard_from(self, now: Moment) -> Iterator[Diagnosis]:
        """Yield the present diagnostics of our daemons, and what the device's own daemon wrote into the
        recording."""
        return (o for o in self._daemons() if o is self.noted or o.is_current(now.at))

    def own(self, now: Moment) -> Diagnosis | None:
        """Return the present diagnostics of the device's own daemon. Return None if the daemon is
        silent or not ours."""
        return next((one for one in self.heard_from(now) if one.kind == self.kind), None)

    def told(self, key: str, now: Moment) -> str:
        """Return the present value of this key from the device's own daemon. Return "" if the value is
        unknown."""
        said = self.teller(key, now)
        return said.values[key] if said else ""

    def teller(self, key: str, now: Moment) -> Diagnosis | None:
        """Return the present diagnostics of the device's own daemon that have this key."""
        own = (one for one in self.heard_from(now) if one.kind == self.kind)
        return next((one for one in own if key in one.values), None)

    def faults(self, now: Moment) -> dict[str, tuple[str, Moment]]:
        """Return fault code -> the fault's detail and beginning. The faults from the device's own
        daemon come first."""
        found: dict[str, tuple[str, Moment]] = {}
        for one in sorted(self.heard_from(now), key=lambda one: one.kind != self.kind):
            for code, fault in one.faults.items():
                found.setdefault(code, fault)
        return found

    def waits_said(self, now: Moment) -> dict[str, str]:
        """Return kind of daemon -> the reason why requesters wait. The reason is the text of our daemon
        of that kind."""
        said = ((one.kind, one.values.get("waits")) for one in self.heard_from(now))
        return {kind: label(text, 200) for kind, text in said if text}

    def refusals(self, now: Moment, since: float, kind: str = "") -> list[str]:
        """Return the reasons of refusals since time `since` (s). The latest reason comes first. `kind`:
        the kind of the daemon that refuses; "" for any kind."""
        found = [
            (last.at, reason)
            for one in self.heard_from(now)
            for reason, (_, last) in one.refused.items()
            if last.seen and last.at >= since and kind in ("", one.kind)
        ]
        return [reason for _, reason in sorted(found, reverse=True)]

    def _fault(self, one: News) -> str:
        """Return the story line of a fault, or "". A daemon first notes a fault and later publishes the
        same fault, but the story tells the fault only once."""
        found = self.diagnoses[one.who] if one.who else self.noted
        assert found is not None
        if self.notes_faults and one.who and found.kind == self.kind:
            return ""
        if one.what == "fault over":
            return f"fault {one.text} is over"
        own = (daemon for daemon in self._daemons() if daemon.kind == self.kind)
        if any(one.text in daemon.faults for daemon in own if daemon is not found):
            return ""
        detail, _ = found.faults[one.text]
        return f"fault {one.text}" + (f": {detail}" if detail else "")
