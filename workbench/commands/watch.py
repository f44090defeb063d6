"""`rmf-bridge watch`: show the RMF graph's lifts, doors and chargers live, with one row for each
device.

`board.py` makes the rows. A terminal shows one table that changes in place. A pipe gets one line for
each change. Ctrl-C is the normal end, with exit code 0.
"""

import argparse
import json
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import closing
from typing import TextIO

from msgspec.structs import asdict

from bridges.messages import topics
from bridges.system.columns import columns_of
from bridges.system.paint import coloured
from bridges.transports.transport import Transport, TransportError
from workbench.graph.board import (
    Board,
    BoardRow,
    change_line,
    changes,
    fitting,
    json_line,
    repaint,
    table,
)
from workbench.graph.join import (
    add_graph_arguments,
    complain,
    interruptible,
    open_graph,
    seconds,
)
from workbench.graph.live import Ear

REDRAW_S = 0.5
REDRAW_AT_MOST_EVERY_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `watch`."""
    add_graph_arguments(parser)
    parser.add_argument(
        "--once",
        type=seconds(0.1, 86400),
        nargs="?",
        const=3.0,
        metavar="SECONDS",
        help="listen for SECONDS (default 3), print the table, exit; 1 if nothing was heard, else 0",
    )
    parser.add_argument(
        "--json",
        action="store_true",
        help="print a line of JSON for each change, or one list with --once",
    )


def run(args: argparse.Namespace) -> int:
    """Return 0. Return 1 if `--once` heard nothing, or if the program could not join the graph."""
    try:
        with interruptible(), closing(open_graph(args, "rmf_bridge_watch")) as transport:
            ear = listen_on(transport)
            if args.once is not None:
                return show_once(ear, args.once, sys.stdout, as_json=args.json)
            live = sys.stdout.isatty() and not args.json
            show(ear, sys.stdout, live=live, line=json_line if args.json else change_line)
    except TransportError as error:
        complain("watch", error)
        return 1
    except KeyboardInterrupt:
        return 0
    return 0


def listen_on(transport: Transport) -> Ear:
    """Subscribe to every topic that `watch` shows."""
    shown = (
        topics.LIFT_STATES,
        topics.DOOR_STATES,
        topics.CHARGER_STATES,
        topics.DISPENSER_STATES,
        topics.INGESTOR_STATES,
        topics.DOOR_SUPERVISOR_HEARTBEAT,
        topics.CHARGING_ASSIGNMENTS,
        topics.DIAGNOSTICS,
        topics.FIRE_ALARM_TRIGGER,
        topics.EMERGENCY_SIGNAL,
    )
    return Ear(transport, shown)


def show_once(ear: Ear, for_s: float, out: TextIO, *, as_json: bool = False) -> int:
    """Listen for `for_s` (s), and print the table or JSON. Return 0. Return 1 if nothing was heard."""
    board, until = Board(), time.monotonic() + for_s
    while (left_s := until - time.monotonic()) > 0:
        for heard in ear.listen(left_s):
            board.take(heard)
    rows = board.rows(time.monotonic(), time.time())
    if not rows:
        complain("watch", "no lift, door, charger or robot heard: check the domain and network")
        return 1
    columns = columns_of(out)
    lines = [line for line, _ in fitting(rows, columns)] if columns else table(rows)
    told = json.dumps([asdict(row) for row in rows]) if as_json else "\n".join(lines)
    out.write(told + "\n")
    out.flush()
    return 0


def settled(board: Board, now: float, wall: float) -> list[BoardRow]:
    """Return the rows. Leave out a device if later messages may still prove that a simulation publishes
    the device."""
    young = board.unsettled(now)
    return [row for row in board.rows(now, wall) if (row.kind, row.name) not in young]


def show(
    ear: Ear, out: TextIO, *, live: bool, line: Callable[[BoardRow, float], str] = change_line
) -> None:
    """Show the rows until Ctrl-C. With `live`, redraw the table in place. Otherwise print a line for
    each change."""
    board, rows, drawn = Board(), list[BoardRow](), 0
    next_at = 0.0
    while True:
        for heard in ear.listen(REDRAW_S):
            board.take(heard)
        now, wall = time.monotonic(), time.time()
        before, rows = rows, settled(board, now, wall)
        if not live:
            out.writelines(line(row, wall) + "\n" for row in changes(before, rows))
        elif now >= next_at:
            size = shutil.get_terminal_size()
            text, drawn = repaint(rows, drawn, size.columns, size.lines, coloured=coloured(out))
            out.write(text)
            next_at = now + REDRAW_AT_MOST_EVERY_S
        out.flush()
