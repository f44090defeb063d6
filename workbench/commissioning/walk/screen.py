"""The display of a walk (`rmf-bridge walk`) on a terminal, even on a phone. Tables are redrawn in
place, and keys give commands."""

import os
import re
import select
import shutil
import sys
import termios
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final, NamedTuple

from bridges.system.columns import aligned, clipped, width, wrapped
from bridges.system.paint import coloured, repainted
from workbench.commissioning.walk.bench import Bench, ContactReading
from workbench.commissioning.walk.core import ByEye, Switch
from workbench.commissioning.walk.signed import NOT_TRIED

HELP: Final = "ENTER on/off   n next   p back   y seen   x not seen   q end"
WIDE: Final = 60
"""Minimum number of columns at which the display also shows the wires. A phone has about 40 columns."""
HEADINGS: Final = 2
BOLD, DIM, ALARM, ON = "1", "2", "1;31", "1;33"
HIDE_CURSOR, SHOW_CURSOR = "\x1b[?25l", "\x1b[?25h"
UP, DOWN = "\x1b[A", "\x1b[B"
KEY: Final = re.compile(r"\x1b\[[A-Z]|.", re.S)

Lines = list[tuple[str, str]]
"""Lines of text, each with its style (`bridges/system/paint.py`)."""


class Screen:
    """The display and the keys of a walk. `cursor` is the output that ENTER switches."""

    def __init__(self, device: str, bench: Bench) -> None:
        self._device = device
        self._bench = bench
        self._cursor = 0
        self._above = 0

    def __enter__(self) -> "Screen":
        sys.stdout.write(HIDE_CURSOR)
        return self

    def __exit__(self, *error: object) -> None:
        sys.stdout.write(f"{SHOW_CURSOR}\n")
        sys.stdout.flush()

    def draw(self, now: float) -> None:
        """Draw the present state. `now` is the monotonic time (s)."""
        plain = not coloured(sys.stdout)
        page = self.page(now, *shutil.get_terminal_size())
        *above, (last, _) = [(text, "" if plain else style) for text, style in page]
        sys.stdout.write(f"{repainted(above, self._above)}\r{last}")  # a newline would scroll
        sys.stdout.flush()
        self._above = len(above)

    def obey(self, key: str) -> bool:
        """Act on a key. Return False for the key that ends the walk."""
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

    def page(self, now: float, columns: int, rows: int) -> Lines:
        """Return the lines of the display. Cut the lists to the space of the terminal."""
        memory = self._bench.memory
        age = "not read yet" if memory.read_at is None else f"read {now - memory.read_at:.1f} s ago"
        texts = (
            (f"{self._device}: {age}", BOLD),
            (self._bench.decoded, ""),
            (self._selected(), ""),
            (memory.why_lost or memory.says, ALARM),
            (HELP, DIM),
        )
        title, decoded, *below = (
            [(line, style) for line in wrapped(text, columns)] for text, style in texts
        )
        free = rows - sum(map(len, (title, decoded, *below))) - HEADINGS
        shown = room(free, len(self._bench.inputs), len(self._bench.steps))
        inputs = self._inputs(now, shown.inputs, columns)
        outputs = self._outputs(now, shown.outputs, columns)
        return [*title, *inputs, *decoded, *outputs, *(line for part in below for line in part)]

    def _selected(self) -> str:
        """Describe the output at the cursor, and the effect that the person or the inputs have shown up
        to now."""
        if not self._bench.steps:
            return "no output can be tried here"
        step = self._bench.steps[self._cursor]
        seen = self._bench.memory.results.get(self._cursor, NOT_TRIED)
        return f"{step.name} {step.does}; should be seen: {step.expects}. So far: {seen}"

    def _inputs(self, now: float, most: int, columns: int) -> Lines:
        """List every input. If there is too little room, list the inputs that changed last."""
        known = self._bench.inputs
        if not known:
            nothing = "no contacts; see the decoded values"
            return [(line, DIM) for line in wrapped(nothing, columns)]
        latest = sorted(known, key=lambda one: -(one.changed_at or 0.0))[:most]
        shown = [one for one in known if one in latest]
        rows = [("input", "wire", "level", "is", "for", "seen"), *(_row(one, now) for one in shown)]
        if columns < WIDE:
            rows = [(name, *told) for name, _, *told in rows]
        styles = [DIM, *(BOLD if one.asserted else "" for one in shown)]
        more = len(known) - most
        return [
            *zip(_fitted(rows, 0, columns), styles, strict=True),
            *([(f"… {more} more", "")] if more > 0 else []),
        ]

    def _outputs(self, now: float, most: int, columns: int) -> Lines:
        """List every output. If there is too little room, list the outputs around the cursor."""
        memory, steps = self._bench.memory, self._bench.steps
        rows, styles = [("", "output", "is", "seen")], [DIM]
        first = max(0, min(self._cursor - most // 2, len(steps) - most))
        for i, step in list(enumerate(steps))[first : first + most]:
            on = i == memory.on
            is_now = f"ON, {max(0.0, memory.off_at - now):.0f} s" if on else "off"
            mark = ">" if i == self._cursor else ""
            rows.append((mark, step.name, is_now, _short(memory.results.get(i, ""))))
            styles.append(ON if on else "")
        return [*zip(_fitted(rows, 1, columns), styles, strict=True)]


class Room(NamedTuple):
    """Number of rows for inputs and for outputs."""

    inputs: int
    outputs: int


def room(rows: int, inputs: int, outputs: int) -> Room:
    """Divide the rows between inputs and outputs. Up to three outputs get rows first, then the inputs.
    The other outputs get the remaining rows."""
    least = min(outputs, 3)
    if inputs + least <= rows:
        return Room(inputs, min(outputs, rows - inputs))
    for_inputs = max(1, rows - least - 1)  # the last row tells how many inputs are hidden
    return Room(for_inputs, least)


def _short(result: str) -> str:
    """Shorten a result to a word or two for the table."""
    known = (word for word in ("seen", "not seen") if result.startswith(word))
    return next(known, "nothing yet" if result else "")


def _fitted(rows: Sequence[tuple[str, ...]], names: int, columns: int) -> list[str]:
    """Format the rows as lines. If a line is too long, shorten the names in column `names`."""
    lines = aligned(rows)
    if (over := max(map(width, lines)) - columns) > 0:
        longest = max(width(row[names]) for row in rows)
        most = max(longest - over, 2)
        rows = [(*row[:names], _cut(row[names], most), *row[names + 1 :]) for row in rows]
        lines = [clipped(line, columns) for line in aligned(rows)]
    return lines


def _cut(text: str, columns: int) -> str:
    return text if width(text) <= columns else f"{clipped(text, columns - 1)}…"


def _row(one: ContactReading, now: float) -> tuple[str, ...]:
    if one.level is None or one.changed_at is None:
        return (one.wire.signal, one.wire.point, "?", "?", "", "")
    level = "high" if one.level else "low"
    both = "on, off" if len(one.seen) == 2 else ("on" if one.asserted else "off")
    is_now = "on" if one.asserted else "off"
    return (one.wire.signal, one.wire.point, level, is_now, f"{now - one.changed_at:.0f} s", both)


@contextmanager
def keyboard() -> Iterator[int]:
    """Set the terminal to single keys, and yield the terminal's file descriptor. At the end, restore
    the terminal."""
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)
    try:
        yield terminal
    finally:
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def keys(terminal: int, wait_s: float) -> list[str]:
    """Return the pressed keys. Return [] if no key comes within `wait_s` (s), and ["q"] if the terminal
    is gone."""
    if not select.select([terminal], [], [], wait_s)[0]:
        return []
    try:
        typed = os.read(terminal, 64).decode(errors="replace")
    except OSError:
        typed = ""
    return KEY.findall(typed) or ["q"]
