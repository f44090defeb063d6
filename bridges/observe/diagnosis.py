"""The latest reports of our nodes on `/diagnostics`, about a device or about the node itself."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from bridges.messages.definitions import DiagnosticLevel, DiagnosticStatus
from bridges.messages.words import KINDS, Kind
from bridges.observe.limits import MOST_CODES, MOST_VALUES, QUIET_S, SILENT_S
from bridges.observe.news import News
from bridges.observe.requesters import Moment

SIMULATED: Final = "SIMULATED"
PASSIVE: Final = "PASSIVE"
COORDINATOR: Final = "charger_coordinator"
PANEL: Final = "alarm"
FLEET: Final = "fleet"
STATELESS: Final = (COORDINATOR, PANEL, FLEET)
"""The kinds of things that are known only from diagnostics, because they publish no state that
`ObservedGraph` knows."""
REFUSED: Final = "refused "


def faults(status: DiagnosticStatus) -> tuple[str, ...]:
    """Return the codes of the faults in a device's status."""
    shown = status.message if status.level == DiagnosticLevel.ERROR else ""
    return tuple(code for code in shown.split(", ") if code)


def kind_in(status: DiagnosticStatus) -> str:
    """Return the kind of our daemon that sent the status. Return "" for any other sender."""
    return next((pair.value for pair in status.values if pair.key == "kind"), "")


def about(status: DiagnosticStatus) -> tuple[Kind, str] | None:
    """Return the device that a status of our daemons is about. A supervisor's status is about its lift
    or door."""
    kind = kind_in(status).removesuffix("_supervisor")
    found = next((known for known in KINDS if known == kind), None)
    return (found, status.hardware_id) if found else None


def of_node(status: DiagnosticStatus) -> bool:
    """Return whether the status is about one of our daemons itself. Also return True for a status about
    a coordinator's site, an alarm panel or a robot (the kinds in STATELESS)."""
    kind = kind_in(status)
    of_daemon = bool(kind) and status.name == f"{status.hardware_id}: daemon"
    return kind in STATELESS or of_daemon


@dataclass(slots=True)
class Diagnosis:
    """The latest report that one node has sent about one device, or about itself.

    - `kind`: the kind of the node's daemon
    - `name`: `<node>: <device>`
    - `last`: the time of the last status
    - `faults`: maps the code of each fault to its detail and its beginning. If several faults of the
      last status have the same code, the detail joins their details.
    - `every_fault`: the code and the detail of each fault of the last status
    - `refused`: maps each reason for refusals to their number and the time of the last refusal
    """

    kind: str
    last: Moment
    name: str = ""
    message: str = ""
    values: Mapping[str, str] = field(default_factory=dict)
    faults: dict[str, tuple[str, Moment]] = field(default_factory=dict)
    every_fault: tuple[tuple[str, str], ...] = ()
    refused: dict[str, tuple[int, Moment]] = field(default_factory=dict)

    @property
    def subject(self) -> tuple[str, str]:
        """The kind and the name of the report's subject. The subject is a device or a site, or the node
        itself, whose kind is then `daemon`."""
        node, _, subject = self.name.partition(": ")
        return ("daemon", node) if subject == "daemon" else (self.kind, subject)

    def is_current(self, now: float) -> bool:
        """Return whether the report is recent enough to count."""
        return now - self.last.at <= SILENT_S

    def value(self, key: str) -> str:
        """Return the value of this key. Return "" if the value is missing or "-"."""
        found = self.values.get(key, "")
        return "" if found == "-" else found

    def take(
        self,
        moment: Moment,
        status: DiagnosticStatus,
        text: Callable[[str], str] = str,
        sentence: Callable[[str], str] = str,
    ) -> Iterator[News]:
        """Take the next status, and yield the news. `text` converts a name from the network to the form
        that is kept in memory. `sentence` converts the detail of a fault."""
        self.kind, self.last, self.message = kind_in(status), moment, status.message
        told, codes = status.values[:MOST_VALUES], [*dict.fromkeys(faults(status))][:MOST_CODES]
        details = {code: [one.value for one in told if one.key == code] for code in codes}
        self.every_fault = tuple(
            (text(code), "" if one == "-" else sentence(one))
            for code in codes
            for one in details[code] or [""]
        )
        joined = {
            code: "; ".join(one for one in every if one != "-")
            for code, every in details.items()
            if every
        }
        self.values = {pair.key: pair.value for pair in told} | joined
        yield from self.has(moment, {text(code): sentence(self.value(code)) for code in codes})
        for key, value in self.values.items():
            if key.startswith(REFUSED) and value.isdecimal() and len(value) <= 18:
                yield from self.refuses(moment, text(key.removeprefix(REFUSED)), int(value))

    def has(self, moment: Moment, codes: Mapping[str, str]) -> Iterator[News]:
        """Replace the faults by these faults (code -> detail). Yield the news."""
        over, new = self.faults.keys() - codes.keys(), codes.keys() - self.faults.keys()
        gone = [code for code in self.faults if code in over]
        self.faults = {
            code: (detail, self.faults[code][1] if code in self.faults else moment)
            for code, detail in codes.items()
        }
        yield from (News("fault over", moment, self.name, code) for code in gone)
        yield from (News("fault", moment, self.name, code) for code in codes if code in new)

    def refuses(self, moment: Moment, reason: str, count: int | None = None) -> Iterator[News]:
        """Note refusals for this reason, and yield the news. `count`: the total number of refusals, or
        None for one more refusal."""
        before, last = self.refused.get(reason, (0, None))
        if (last is None and len(self.refused) >= MOST_CODES) or (last and before == count):
            return
        self.refused[reason] = before + 1 if count is None else count, moment
        if moment.seen if last is None else moment.at - last.at > QUIET_S:
            yield News("refused", moment, self.name, reason)


def report(
    known: dict[str, Diagnosis], most: int, status: DiagnosticStatus, moment: Moment
) -> Diagnosis | None:
    """Return the diagnosis to which this status belongs, or make a new diagnosis. If `known` is full,
    the new diagnosis replaces a diagnosis without recent reports. Return None if all diagnoses have
    recent reports."""
    if status.name not in known:
        silent = (name for name, one in known.items() if not one.is_current(moment.at))
        if len(known) >= most and known.pop(next(silent, ""), None) is None:
            return None
        known[status.name] = Diagnosis(kind_in(status), moment, status.name)
    return known[status.name]
