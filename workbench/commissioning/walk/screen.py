"""A walk on a terminal, also that of a phone: tables that are redrawn in place, and keys."""

import os
import re
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from workbench.commissioning.walk.bench import Bench, Input
from workbench.commissioning.walk.core import ByEye, Switch
from workbench.commissioning.walk.signed import NOT_TRIED

HELP: Final = "ENTER on/off   n next   p back   y seen   x not seen   q end"
WIDE: Final = 60
"""Columns from which the wires are shown too: a phone has about 40."""
HEADINGS: Final = 2
UP, DOWN = "\x1b[A", "\x1b[B"
KEY: Final = re.compile(r"\x1b\[[A-Z]|.", re.S)


class Screen:
    """What the person sees and types. `cursor`: the output that ENTER switches."""

    def __init__(self, device: str, bench: Bench, console: Console | None = None) -> None:
        self._device = device
        self._bench = bench
        self._cursor = 0
        self._live = Live(console=console or Console(), auto_refresh=False, transient=False)

    def __enter__(self) -> "Screen":
        self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._live.stop()

    def draw(self, now: float) -> None:
        """Show everything as it is now (monotonic s)."""
        self._live.update(self.page(now), refresh=True)

    def obey(self, key: str) -> bool:
        """Act on a key. False for the one that ends the walk."""
        steps = len(self._bench.steps)
        if key == "q":
            return False
        if not steps:
            return True
        if key in ("\r", "\n", " "):
            self._bench.put(Switch(self._cursor))
        elif key in ("y", "x"):
            self._bench.put(ByEye(self._cursor, key == "y"))
        elif key in ("n", "j", DOWN):
            self._cursor = (self._cursor + 1) % steps
        elif key in ("p", "k", UP):
            self._cursor = (self._cursor - 1) % steps
        return True

    def page(self, now: float) -> Group:
        """Everything as it is now, as far as there is room."""
        memory, console = self._bench.memory, self._live.console
        age = "not read yet" if memory.read_at is None else f"read {now - memory.read_at:.1f} s ago"
        texts = [
            Text(f"{self._device}: {age}", style="bold"),
            Text(self._bench.decoded),
            Text(self._selected()),
            Text(memory.why_lost or memory.says, style="bold red"),
            Text(HELP, style="dim"),
        ]
        title, decoded, selected, says, keys_ = texts
        free = console.height - len(console.render_lines(Group(*texts))) - HEADINGS
        shown = room(free, len(self._bench.inputs), len(self._bench.steps))
        return Group(
            title,
            self._inputs(now, shown.inputs, wires=console.width >= WIDE),
            decoded,
            self._outputs(now, shown.outputs),
            selected,
            says,
            keys_,
        )

    def _selected(self) -> str:
        """What the output at the cursor does, and what was seen of it."""
        if not self._bench.steps:
            return "no output can be tried here"
        step = self._bench.steps[self._cursor]
        seen = self._bench.memory.results.get(self._cursor, NOT_TRIED)
        return f"{step.name} {step.does}; should be seen: {step.expects}. So far: {seen}"

    def _inputs(self, now: float, most: int, *, wires: bool) -> Table | Text:
        """Every input; where there is no room, those that have changed last."""
        if not self._bench.inputs:
            return Text("no contacts: registers or messages, decoded", style="dim")
        table = _table("input", *(["wire"] if wires else []), "level", "is", "for", "seen")
        known = self._bench.inputs
        latest = sorted(known, key=lambda one: -(one.changed_at or 0.0))[:most]
        for one in (one for one in known if one in latest):
            name, wire, *told = _row(one, now)
            cells = (name, wire, *told) if wires else (name, *told)
            table.add_row(*cells, style="bold" if one.asserted else "")
        if len(known) > most:
            table.add_row(f"… {len(known) - most} more")
        return table

    def _outputs(self, now: float, most: int) -> Table:
        """Every output; where there is no room, those around the cursor."""
        memory, steps = self._bench.memory, self._bench.steps
        table = _table("", "output", "is", "seen")
        first = max(0, min(self._cursor - most // 2, len(steps) - most))
        for i, step in list(enumerate(steps))[first : first + most]:
            on = i == memory.on
            is_now = f"ON, {max(0.0, memory.off_at - now):.0f} s" if on else "off"
            mark = ">" if i == self._cursor else ""
            told = _short(memory.results.get(i, ""))
            table.add_row(mark, step.name, is_now, told, style="bold yellow" if on else "")
        return table


class Room(NamedTuple):
    """How many rows of inputs and of outputs fit."""

    inputs: int
    outputs: int


def room(rows: int, inputs: int, outputs: int) -> Room:
    """Share so many rows: three outputs at least, then inputs, then more outputs."""
    least = min(outputs, 3)
    if inputs + least <= rows:
        return Room(inputs, min(outputs, rows - inputs))
    for_inputs = max(1, rows - least - 1)  # a row says how many more there are
    return Room(for_inputs, least)


def _short(result: str) -> str:
    """A result as a word or two, for the table."""
    known = (word for word in ("seen", "not seen") if result.startswith(word))
    return next(known, "nothing yet" if result else "")


def _table(*headings: str) -> Table:
    """Narrow: no frame, and one row for each line."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    return table


def _row(one: Input, now: float) -> tuple[str, ...]:
    if one.level is None or one.changed_at is None:
        return (one.wire.signal, one.wire.point, "?", "?", "", "")
    level = "high" if one.level else "low"
    both = "on, off" if len(one.seen) == 2 else ("on" if one.asserted else "off")
    is_now = "on" if one.asserted else "off"
    return (one.wire.signal, one.wire.point, level, is_now, f"{now - one.changed_at:.0f} s", both)


@contextmanager
def keyboard() -> Iterator[int]:
    """The terminal, giving single keys. Puts it back as it was."""
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)
    try:
        yield terminal
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def keys(terminal: int, wait_s: float) -> list[str]:
    """The keys that were pressed; none after `wait_s`, "q" if the terminal has gone."""
    if not select.select([terminal], [], [], wait_s)[0]:
        return []
    try:
        typed = os.read(terminal, 64).decode(errors="replace")
    except OSError:
        typed = ""
    return KEY.findall(typed) or ["q"]
