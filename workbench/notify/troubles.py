"""A site's present troubles, found in the memory of its devices. All functions are pure."""

from collections.abc import Callable, Container, Iterable, Iterator
from typing import Any, Final

from msgspec import Struct

from bridges.messages.words import printable
from bridges.observe.all_devices import AnyDevice, ObservedGraph
from bridges.observe.lift import NOBODY, ObservedLift
from bridges.observe.requesters import Moment
from bridges.runtime.daemons import DOWN, DaemonStatus
from bridges.system.certificates import SOON_S, URGENT_S, CertificateEnd, told
from workbench.notify.settings import NotifySettings, Severity

SILENT: Final = "SILENT"
NOT_SERVING: Final = "NOT_SERVING"
LEFT_ON: Final = "LEFT_ON"
RAISED: Final = "ALARM_RAISED"
"""The fault of a daemon whose alarm makes robots stand."""
ALARMS: Final = "ALARM_"
"""The first letters of the fault codes whose details say why robots stand."""


def severity_of(code: str) -> Severity:
    """Return the severity of a fault of a panel, robot, coordinator or daemon."""
    return "critical" if code == RAISED else "warning"


class Trouble(Struct, frozen=True):
    """One trouble of one device. `what` is a code that stays the same as long as the trouble lasts.
    `before_s` is the time (s) for which it has lasted before it counts as a trouble. `stage` rises when
    the trouble gets worse."""

    kind: str
    device: str
    what: str
    severity: Severity
    headline: str
    before_s: float = 0.0
    stage: int = 0

    @property
    def key(self) -> str:
        """The trouble's name, for `--ack` and on disk."""
        return f"{self.kind} {self.device}: {self.what}"


def troubles(graph: ObservedGraph[Any], now: Moment, settings: NotifySettings) -> Iterator[Trouble]:
    """Yield the present troubles. A silent device has only the trouble SILENT, because nothing else is
    known about the device."""
    for one in graph.stated():
        name = printable(one.id)
        if one.is_silent(now):
            headline = f"{one.kind} {name} is silent"
            yield Trouble(one.kind, name, SILENT, "critical", headline)
            continue
        yield from _of_lift(one, name, now, settings)
        if len(one.publishers(now)) > 1:
            headline = f"several nodes publish {one.kind} {name}"
            yield Trouble(one.kind, name, "TWO_NODES", "critical", headline)
        for code in sorted({code for said in _current(one, now) for code in said}):
            shown = printable(code)
            yield Trouble(one.kind, name, shown, "warning", f"{one.kind} {name}: {shown}")
        if any(now.at - wait.since.at > settings.waits_s for wait in one.waits(now)):
            headline = f"a robot waits for {one.kind} {name}"
            yield Trouble(one.kind, name, "WAITING", "warning", headline, settings.waits_s)
    yield from _of_nodes(graph, now)


def of_certificates(
    named: Iterable[tuple[str, str, str]], end: Callable[[str], CertificateEnd], now: float
) -> Iterator[Trouble]:
    """Yield the troubles of these certificates, each (daemon, key, file). `now` is the wall time (s).

    A certificate is a trouble a month before it expires. The trouble's stage rises a week before the
    expiry and at the expiry, so people get a further notice each time.
    """
    for daemon, key, file in named:
        found = end(file)
        left_s = SOON_S if found.at is None else found.at - now
        if found.at is not None and left_s >= SOON_S:
            continue
        stage = (left_s < URGENT_S) + (left_s < 0)
        what = "UNREADABLE" if found.at is None else "EXPIRES"
        yield Trouble(
            "daemon",
            daemon,
            printable(f"CERTIFICATE_{what} {key} {file}"),
            "critical" if left_s < 0 else "warning",
            printable(told(f"certificate {file} ({daemon}, {key})", found, now)),
            stage=stage,
        )


def of_daemons(
    found: Iterable[DaemonStatus], heard: Container[tuple[str, str]]
) -> Iterator[Trouble]:
    """Yield the troubles of this machine's daemons that do not serve. `heard` has the kind and name of
    each device heard since the start.

    Leave out a daemon whose devices were all heard, because `troubles` yields SILENT for each of them.
    """
    for one in found:
        name, kind = printable(one.name), str(one.status.get("kind", ""))
        if one.state == "left on":
            headline = f"daemon {name} has died, and its outputs are not verified off"
            yield Trouble("daemon", name, LEFT_ON, "critical", f"{headline}; {printable(one.why)}")
        elif one.level == DOWN:
            told = [(kind, printable(device)) in heard for device in one.devices]
            if not told or not all(told):
                headline = f"daemon {name} does not serve"
                yield Trouble("daemon", name, NOT_SERVING, "critical", headline)


def heard_now(graph: ObservedGraph[Any], now: Moment) -> set[tuple[str, str]]:
    """Return the kind and name of each subject about which something is known now."""
    stated = {(one.kind, printable(one.id)) for one in graph.stated() if not one.is_silent(now)}
    return stated | {
        (report.subject[0], printable(report.subject[1]))
        for report in graph.nodes.values()
        if report.is_current(now.at)
    }


def _of_nodes(graph: ObservedGraph[Any], now: Moment) -> Iterator[Trouble]:
    """Yield the troubles of alarm panels, robots, coordinators and our daemons.

    Leave out a silent daemon of a lift, door or charger, because `troubles` already yields SILENT for
    that device.
    """
    for report in graph.nodes.values():
        kind, named = report.subject[0], printable(report.subject[1])
        if kind != "daemon" and not report.is_current(now.at):
            headline = f"{kind} {named} is silent"
            yield Trouble(kind, named, SILENT, "critical", headline)
        for code in sorted(report.faults) if report.is_current(now.at) else ():
            shown = printable(code)
            detail = f": {printable(report.faults[code][0])}" if code.startswith(ALARMS) else ""
            headline = f"{kind} {named}: {shown}{detail}"
            yield Trouble(kind, named, shown, severity_of(code), headline)


def _of_lift(one: AnyDevice, name: str, now: Moment, settings: NotifySettings) -> Iterator[Trouble]:
    if not isinstance(one, ObservedLift) or one.session.value == NOBODY:
        return
    facts = (one.floor, one.door, one.motion, one.mode, one.session, one.destination)
    if now.at - max(fact.since.at for fact in facts) > settings.stuck_s:
        headline = f"lift {name} has a robot and does not move"
        yield Trouble("lift", name, "STUCK", "critical", headline, settings.stuck_s)


def _current(one: AnyDevice, now: Moment) -> Iterator[list[str]]:
    for said in one.diagnoses.values():
        if said.is_current(now.at):
            yield [*said.faults]
