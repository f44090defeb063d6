"""The rows of `watch`, made from messages and a time. All functions are pure.

RMF's states have no fields for faults, for waiting robots, or for "this device is simulated". Our
daemons publish this information on `/diagnostics`.
"""

import json
import re
import time
from collections.abc import Iterable, Iterator
from typing import Any, Final

from msgspec import Struct
from msgspec.structs import asdict, replace

from bridges.messages import definitions as d
from bridges.messages import words
from bridges.messages.heard import Heard
from bridges.observe.alarms import alarms
from bridges.observe.all_devices import AnyDevice, ObservedGraph, PlainGraph
from bridges.observe.diagnosis import COORDINATOR, PANEL, PASSIVE, Diagnosis
from bridges.observe.door import ObservedDoor
from bridges.observe.limits import SILENT_S
from bridges.observe.requesters import Moment
from bridges.observe.robots import ObservedRobot, robots, waits
from bridges.system.columns import aligned, clipped, hanging, width
from bridges.system.paint import repainted

SETTLES_S: Final = 1.5
"""Time (s) from a device's first state until its daemon's diagnostics must have come. Diagnostics come
at 1 Hz."""
HEADINGS: Final = ("kind", "name", "state", "held by", "waiting", "age", "", "faults")
MOST_PLACES: Final = 500
"""Maximum number of robots in memory. Anybody can invent names, and the page listens for months."""
SECONDS: Final = re.compile(r"\d+(\.\d+)? (s|min)\b")

Device = tuple[str, str]
"""A device's kind and printable name."""


class BoardRow(Struct, frozen=True):
    """One device, an alarm, the charger coordinator, or a robot with its assigned place.

    - `held_by`: the holder, or the assigned charging place of a robot.
    - `waiting`: the waiting robots, or the thing that the holder or the robot waits for.
    - `age`: the reading's age, in words.
    - `mark`: the reason why the row may be wrong.
    - `simulated`: whether the device has no hardware.
    - `faults`: the faults that the device's daemons report.
    """

    kind: str
    name: str
    state: str
    held_by: str = "-"
    waiting: str = ""
    age: str = "-"
    mark: str = ""
    simulated: bool = False
    faults: str = ""

    @property
    def wrong(self) -> bool:
        """Return whether the row needs a person's attention."""
        return bool(self.mark or self.faults)

    def cells(self) -> tuple[str, ...]:
        """Return the row's texts, in the order of HEADINGS."""
        marks = " ".join(
            word for word in ("SIMULATED" if self.simulated else "", self.mark) if word
        )
        state = (self.kind, self.name, self.state, self.held_by)
        return (*state, self.waiting, self.age, marks, self.faults)

    def news(self) -> tuple[object, ...]:
        """The row's values without the seconds that count up. If these values change, `watch` prints a
        new line."""
        told = (self.state, self.held_by, self.waiting, self.mark, self.faults)
        return (self.simulated, *(SECONDS.sub("", text) for text in told))


class Board:
    """The latest state and diagnosis of each device."""

    def __init__(self, graph: ObservedGraph[Any] | None = None) -> None:
        """Begin without messages. Pass a `graph` that another object fills, if there is one. Otherwise
        the board fills its own."""
        self._graph = graph or PlainGraph()
        self._places: dict[str, str] = {}

    def take(self, heard: Heard) -> None:
        """Take a message."""
        self._graph.hear(heard)
        self.note(heard)

    def note(self, heard: Heard) -> None:
        """Take a message's charging assignments. `ObservedGraph` takes everything else."""
        if not isinstance(heard.message, d.ChargingAssignments):
            return
        for one in heard.message.assignments:
            place = f"{words.plain(d.ChargingMode, one.mode)} at {one.waypoint_name}"
            who = words.printable(f"{heard.message.fleet_name}/{one.robot_name}")
            if who in self._places or len(self._places) < MOST_PLACES:
                self._places[who] = place

    def unsettled(self, now: float) -> set[Device]:
        """Return kind and name of the devices that were first heard a moment ago. Their daemons may not
        have said yet whether the devices are simulated."""
        return {
            (one.kind, words.printable(one.id))
            for one in self._graph.stated()
            if one.first_state and now - one.first_state.at < SETTLES_S
            if not any(said.kind == one.kind for said in one.said)
        }

    def rows_of(self, devices: Iterable[AnyDevice], now: float, wall: float) -> list[BoardRow]:
        """Return these devices' rows, in the given order. Each device must have published a state."""
        return [self._device(one, now, wall) for one in devices]

    def rows(self, now: float, wall: float) -> list[BoardRow]:
        """Return the rows, sorted by kind and name. `now` is monotonic (s). `wall` is the present time
        (s since the epoch), by the clock that stamps the messages."""
        every = [one for kind in words.KINDS for one in sorted(self._graph.stated(kind), key=_name)]
        devices = self.rows_of(every, now, wall)
        return [*devices, *self._alarms(now), *self._coordinators(now), *self._robots(now)]

    def _device(self, one: AnyDevice, now: float, wall: float) -> BoardRow:
        found = one.said
        state: words.Stated = one.state  # type: ignore[assignment]
        held_by = words.holder(state)
        if isinstance(one, ObservedDoor):
            held_by = words.printable(" ".join(one.holders))
        return BoardRow(
            one.kind,
            words.printable(one.id),
            words.condition(state),
            held_by or "-",
            words.printable(", ".join(filter(None, map(_waiting, found)))),
            _age(one.stamped_at, wall),
            _mark(one, now),
            self._graph.is_simulated(one),
            _faults(found),
        )

    def _alarms(self, now: float) -> Iterator[BoardRow]:
        """Yield a row for each daemon that raises an alarm, and for each alarm panel."""
        nodes = self._graph.nodes
        for one in alarms(nodes, self._graph.published, now):
            daemon = nodes.get(f"{one.node}: daemon")
            simulated = daemon is not None and self._graph.simulated(daemon)
            text, faults = one.condition, _faults([daemon] if daemon else [])
            mark = _silent(daemon.last, now) if daemon else ""
            yield BoardRow("alarm", one.node, text, mark=mark, simulated=simulated, faults=faults)
        for name, panel in nodes.items():
            if panel.kind == PANEL and not name.endswith(": daemon"):
                state = f"{panel.value('state')}: {panel.value('active') or 'no source'}"
                shown = words.printable(name.partition(": ")[2])
                yield BoardRow(
                    "alarm",
                    shown,
                    words.printable(state),
                    mark=_silent(panel.last, now),
                    simulated=self._graph.simulated(panel),
                    faults=_faults([panel]),
                )

    def _coordinators(self, now: float) -> Iterator[BoardRow]:
        for name, diagnosis in self._graph.nodes.items():
            if diagnosis.kind != COORDINATOR or name.endswith(": daemon"):
                continue
            daemon = self._graph.daemon_of(diagnosis)
            passive = daemon.value(PASSIVE) if daemon else ""
            queue = diagnosis.value("queue")
            yield BoardRow(
                "coordinator",
                words.printable(name.partition(": ")[0]),
                words.printable(f"passive: {passive}") if passive else _coordinates(diagnosis),
                waiting=words.printable(queue),
                mark=_silent(diagnosis.last, now),
                simulated=self._graph.simulated(diagnosis),
                faults=_faults([diagnosis]),
            )

    def _robots(self, now: float) -> Iterator[BoardRow]:
        """Yield a row for each robot that our daemons report. Then yield a row for each other robot
        that has an assigned charging place."""
        found = {one.who: one for one in robots(self._graph.nodes)}
        yield from (self._robot(one, now) for one in found.values())
        for who, place in sorted(self._places.items()):
            if who not in found:
                yield BoardRow("robot", who, words.printable(place))

    def _robot(self, one: ObservedRobot, now: float) -> BoardRow:
        said, silent_s = one.said, now - one.said.last.at
        asks = waits(self._graph.stated(), one.who, self._graph.now)
        return BoardRow(
            "robot",
            one.who,
            words.printable(
                f"at {said.value('at')}, {said.value('doing')}, {said.value('battery')}"
            ),
            held_by=self._places.get(one.who, "-"),
            waiting=words.printable(", ".join(f"{d.kind} {d.id}: {w.wants}" for d, w in asks)),
            age=_seconds(said.value("input_age_s"), silent_s),
            mark=_silent(said.last, now),
            simulated=self._graph.simulated(said),
            faults=_faults([said]),
        )


def _silent(last: Moment, now: float) -> str:
    """Return the mark of a row whose last state or report came at `last`; "" while they come."""
    silent_s = now - last.at
    return f"SILENT {silent_s:.0f} s" if silent_s > SILENT_S else ""


def _waiting(said: Diagnosis) -> str:
    """Return the waiting robots and the reason, such as `fleet/b (12 s): for END of fleet/a`."""
    return ": ".join(filter(None, (said.value("waiting"), said.value("waits"))))


def _coordinates(diagnosis: Diagnosis) -> str:
    """Describe the coordinator's present task and schedule."""
    silent = diagnosis.value("assigns").startswith("no:")
    does = "requests chargers that another node assigns" if silent else "assigns chargers"
    schedule = diagnosis.value("schedule")
    return words.printable(f"{does}, schedule {schedule}" if schedule else does)


def _faults(found: Iterable[Diagnosis]) -> str:
    """Return one text for each fault, such as `OVERLOAD (since 3 s)`."""
    told = [pair for one in found for pair in one.every_fault]
    texts = [f"{code} ({detail})" if detail else code for code, detail in told]
    return words.printable("; ".join(dict.fromkeys(texts)))


def _name(device: AnyDevice) -> str:
    return device.id


def _age(stamped_at: float, wall: float) -> str:
    if stamped_at == 0:
        return "never read"
    age = wall - stamped_at
    if age < 60:
        return f"{age:.1f} s"
    return f"{age / 60:.0f} min" if age < 7200 else f"{age / 3600:.0f} h"


def _seconds(age_s: str, more_s: float) -> str:
    """Return the present age of a reading as text. `age_s` is the age in the last report, which came
    `more_s` (s) ago."""
    try:
        return f"{float(age_s.removesuffix(' s')) + more_s:.1f} s"
    except ValueError:
        return "never read"


def _mark(device: AnyDevice, now: float) -> str:
    if device.last_state and (silent := _silent(device.last_state, now)):
        return silent
    if device.reading.value == "is from the future":
        return "CLOCK AHEAD"
    return "STALE" if device.reading.value else ""


def table(rows: Iterable[BoardRow]) -> list[str]:
    """Format the rows in columns under headings. The columns for waiting robots, marks and faults
    appear only if a row needs them."""
    shown = [row.cells() for row in rows]
    if not shown:
        return ["nothing heard yet"]
    optional = ("waiting", "", "faults")
    columns = [
        [heading, *cells]
        for heading, *cells in zip(HEADINGS, *shown, strict=True)
        if heading not in optional or any(cells)
    ]
    return aligned([*zip(*columns, strict=True)])


def changes(before: list[BoardRow], after: list[BoardRow]) -> list[BoardRow]:
    """Return the rows that have changed. A new age, or seconds that count up, are no change."""
    known = {(row.kind, row.name): row.news() for row in before}
    return [row for row in after if known.get((row.kind, row.name)) != row.news()]


def change_line(row: BoardRow, wall: float) -> str:
    """Format a changed row as one line, for a pipe."""
    clock = time.strftime("%H:%M:%S", time.localtime(wall)) + f".{int(wall * 1000) % 1000:03d}"
    kind, name, state, held_by, waiting, age, marks, faults = row.cells()
    parts = [clock, f"{kind:<7}", f"{name:<12}", f"{state:<38}", held_by]
    parts += [f"waiting: {waiting}"] if waiting else []
    parts += [f"age {age}", *filter(None, (marks, faults))]
    return "  ".join(parts)


def json_line(row: BoardRow, wall: float) -> str:
    """Format a changed row as one JSON line. The line has the time of the change (s since the
    epoch)."""
    return json.dumps({"at": round(wall, 3), **asdict(row)})


def repaint(
    rows: list[BoardRow], lines_before: int, columns: int, lines: int, *, coloured: bool = True
) -> tuple[str, int]:
    """Return the text that redraws the table on a terminal, and the new number of lines.

    `lines_before` is the number of table lines on the terminal now. The text is cut so that no line
    wraps and the table never scrolls.
    """
    shown = list(fitting(rows, columns - 1))
    if len(shown) >= lines:
        more = len(shown) - lines + 2
        shown = [*shown[: lines - 2], (f"… and {more} more", False)]
    drawn = (
        (clipped(line, columns - 1), "31" if coloured and wrong else "") for line, wrong in shown
    )
    return repainted(drawn, lines_before), len(shown)


def fitting(rows: list[BoardRow], columns: int) -> Iterator[tuple[str, bool]]:
    """Yield each line of the table, and whether the line needs attention. If a line is too long for the
    terminal, the row's marks and faults follow on separate lines."""
    heading, *lines = table(rows)
    wide = any(width(line) > columns for line in (heading, *lines))
    if wide and rows:
        plain = [replace(row, mark="", simulated=False, faults="") for row in rows]
        heading, *lines = table(plain)
    yield clipped(heading, columns), False
    for row, line in zip(rows, lines, strict=True):
        yield clipped(line, columns), row.wrong
        told = " ".join(filter(None, row.cells()[-2:]))
        for part in hanging(told, columns - 2) if told and wide else ():
            yield f"  {part}", row.wrong
