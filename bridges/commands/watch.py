"""`rmf-bridge watch`: the lifts, doors and chargers of the RMF graph, live, one row each.

RMF's states have no place for faults; our daemons name theirs on `/diagnostics`.

On a terminal the table is redrawn in place; into a pipe goes one line for each change. Ctrl-C is
how one leaves it, so it exits 0.
"""

import argparse
import shutil
import sys
import time
from collections.abc import Iterable
from contextlib import closing
from dataclasses import astuple, dataclass
from typing import TextIO

from bridges.commands.graph import (
    SILENT_AFTER_S,
    Ears,
    Heard,
    add_graph_arguments,
    complain,
    interruptible,
    open_graph,
)
from bridges.rmf import definitions as d
from bridges.rmf import topics, words
from bridges.rmf.transport import Transport, TransportError
from bridges.serve import diagnostics

REDRAW_S = 0.5
REDRAW_AT_MOST_EVERY_S = 0.1
KINDS = {d.LiftState: "lift", d.DoorState: "door", d.ChargerState: "charger"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of `watch`."""
    add_graph_arguments(parser)
    parser.add_argument(
        "--once",
        type=float,
        nargs="?",
        const=3.0,
        metavar="SECONDS",
        help="listen for SECONDS (3), print the table and exit: 0, or 1 when nothing was heard",
    )


def run(args: argparse.Namespace) -> int:
    """0; 1 when `--once` heard nothing or the graph cannot be joined."""
    try:
        with interruptible(), closing(open_graph(args, "rmf_bridge_watch")) as transport:
            ears = listen_on(transport)
            if args.once is not None:
                return show_once(ears, args.once, sys.stdout)
            show(ears, sys.stdout, live=sys.stdout.isatty())
    except TransportError as error:
        complain("watch", error)
        return 1
    except KeyboardInterrupt:
        return 0
    return 0


def listen_on(transport: Transport) -> Ears:
    """Everything that `watch` shows."""
    return Ears(
        transport,
        topics.LIFT_STATES,
        topics.DOOR_STATES,
        topics.CHARGER_STATES,
        topics.DOOR_SUPERVISOR_HEARTBEAT,
        topics.CHARGING_ASSIGNMENTS,
        topics.DIAGNOSTICS,
    )


# --- what is shown: pure -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Row:
    """One device, or a robot with its place by the charging assignments. `age` is that of the reading;
    `mark` is "" or why not to trust the row; `faults` are what the daemons that serve it name."""

    kind: str
    name: str
    state: str
    holder: str
    age: str
    mark: str
    faults: str = ""


class Board:
    """The latest of each device."""

    def __init__(self) -> None:
        self._latest: dict[tuple[str, str], Heard] = {}
        self._requesters: dict[str, str] = {}
        self._places: dict[str, str] = {}
        self._faults: dict[tuple[str, str], dict[str, tuple[float, tuple[str, ...]]]] = {}

    def take(self, heard: Heard) -> None:
        """One message."""
        match heard.message:
            case d.SupervisorHeartbeat():
                self._requesters = {
                    door.door_name: " ".join(s.requester_id for s in door.sessions)
                    for door in heard.message.all_sessions
                }
            case d.ChargingAssignments(fleet_name=fleet):
                for one in heard.message.assignments:
                    mode = words.word(d.ChargingMode, one.mode)
                    place = words.printable(f"{mode} at {one.waypoint_name}")
                    self._places[words.printable(f"{fleet}/{one.robot_name}")] = place
            case d.DiagnosticArray():
                for status in heard.message.status:
                    self._take_faults(status, heard.at)
            case state:
                key = (KINDS[type(state)], words.device(state))
                self._latest[key] = heard

    def rows(self, now: float, wall: float) -> list[Row]:
        """By kind and name. `now` is monotonic, `wall` the clock that stamps are compared with."""
        return [
            Row(
                kind,
                words.printable(name),
                words.condition(heard.message),
                self._holder(heard.message) or "-",
                _age(words.stamped_at(heard.message), wall),
                _mark(heard, now, wall),
                self._named_faults((kind, name), now),
            )
            for (kind, name), heard in sorted(self._latest.items(), key=_order)
        ] + [Row("robot", who, place, "-", "-", "") for who, place in sorted(self._places.items())]

    def _take_faults(self, status: d.DiagnosticStatus, at: float) -> None:
        """A supervisor's are shown with the lift or door itself. Others write diagnostics too."""
        kind = next((pair.value for pair in status.values if pair.key == "kind"), "")
        device = (kind.removesuffix("_supervisor"), status.hardware_id)
        if device in self._latest:
            self._faults.setdefault(device, {})[status.name] = (at, diagnostics.faults(status))

    def _named_faults(self, device: tuple[str, str], now: float) -> str:
        named = self._faults.get(device, {}).values()
        codes = [code for at, codes in named if now - at <= SILENT_AFTER_S for code in codes]
        return words.printable(" ".join(dict.fromkeys(codes)))

    def _holder(self, state: words.Stated) -> str:
        if isinstance(state, d.DoorState):
            return words.printable(self._requesters.get(state.door_name, ""))
        return words.holder(state)


def _order(entry: tuple[tuple[str, str], Heard]) -> tuple[int, str]:
    (kind, name), _ = entry
    return list(KINDS.values()).index(kind), name


def _age(stamped_at: float, wall: float) -> str:
    if stamped_at == 0:
        return "never"
    age = wall - stamped_at
    if age < 60:
        return f"{age:.1f} s"
    return f"{age / 60:.0f} min" if age < 7200 else f"{age / 3600:.0f} h"


def _mark(heard: Heard, now: float, wall: float) -> str:
    silent_s = now - heard.at
    age = wall - words.stamped_at(heard.message)
    if silent_s > SILENT_AFTER_S:
        return f"SILENT {silent_s:.0f} s"
    if age < -SILENT_AFTER_S:
        return "CLOCK AHEAD"
    return "STALE" if age - silent_s > SILENT_AFTER_S else ""


def table(rows: Iterable[Row]) -> list[str]:
    """The rows in columns, under a heading."""
    shown = [astuple(row) for row in rows]
    faults = "faults" if any(row[-1] for row in shown) else ""
    cells = [("kind", "name", "state", "session or request", "age", "", faults), *shown]
    if len(cells) == 1:
        return ["nothing heard yet"]
    widths = [max(len(cell) for cell in column) for column in zip(*cells, strict=True)]
    return ["  ".join(c.ljust(w) for c, w in zip(r, widths, strict=True)).rstrip() for r in cells]


def changes(before: list[Row], after: list[Row]) -> list[Row]:
    """The rows that say something else than they did, age and seconds of silence apart."""
    known = {(r.kind, r.name): _news(r) for r in before}
    return [r for r in after if known.get((r.kind, r.name)) != _news(r)]


def _news(row: Row) -> tuple[str, ...]:
    return row.state, row.holder, row.mark.rstrip("0123456789 s"), row.faults


def change_line(row: Row, wall: float) -> str:
    """A changed row as one line, to be read in a pipe."""
    clock = time.strftime("%H:%M:%S", time.localtime(wall)) + f".{int(wall * 1000) % 1000:03d}"
    line = f"{clock}  {row.kind:<7}  {row.name:<12}  {row.state:<20}  {row.holder}  age {row.age}"
    return f"{line}  {row.mark}".rstrip() + (f"  {row.faults}" if row.faults else "")


def repaint(rows: list[Row], lines_before: int, columns: int, lines: int) -> tuple[str, int]:
    """What brings a terminal that shows `lines_before` lines of the table to these rows.

    Returns it with the number of lines then shown. No line wraps and nothing scrolls away.
    """
    shown = table(rows)
    if len(shown) >= lines:
        shown = [*shown[: lines - 2], f"… and {len(shown) - lines + 2} more"]
    marked = {i for i, row in enumerate(rows, start=1) if row.mark or row.faults}
    text = f"\x1b[{lines_before}A" if lines_before else ""
    for i, line in enumerate(shown):
        line = line[: columns - 1]
        text += f"\r\x1b[K\x1b[31m{line}\x1b[0m\n" if i in marked else f"\r\x1b[K{line}\n"
    return text + "\x1b[J", len(shown)


# --- showing it --------------------------------------------------------------------------------


def show_once(ears: Ears, seconds: float, out: TextIO) -> int:
    """Listen for so long, print the table: 0, or 1 when nothing was heard."""
    board, until = Board(), time.monotonic() + seconds
    while (left_s := until - time.monotonic()) > 0:
        for heard in ears.listen(left_s):
            board.take(heard)
    rows = board.rows(time.monotonic(), time.time())
    if not rows:
        complain("watch", "no lift, door or charger state heard: same domain, same network?")
        return 1
    out.write("\n".join(table(rows)) + "\n")
    out.flush()
    return 0


def show(ears: Ears, out: TextIO, *, live: bool) -> None:
    """Until interrupted."""
    board, rows, drawn = Board(), list[Row](), 0
    next_at = 0.0
    while True:
        for heard in ears.listen(REDRAW_S):
            board.take(heard)
        now, wall = time.monotonic(), time.time()
        before, rows = rows, board.rows(now, wall)
        if not live:
            out.writelines(change_line(row, wall) + "\n" for row in changes(before, rows))
        elif now >= next_at:
            size = shutil.get_terminal_size()
            text, drawn = repaint(rows, drawn, size.columns, size.lines)
            out.write(text)
            next_at = now + REDRAW_AT_MOST_EVERY_S
        out.flush()
