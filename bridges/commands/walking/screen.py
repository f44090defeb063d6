"""A walk on a terminal, also a narrow one: tables that are redrawn in place, and keys."""

import os
import re
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from bridges.commands.walking.bench import Bench, Input
from bridges.commands.walking.core import ByEye, Switch

HELP: Final = "ENTER on/off   n next   p back   y seen   x not seen   q end"
UP, DOWN = "\x1b[A", "\x1b[B"
KEY: Final = re.compile(r"\x1b\[[A-Z]|.", re.S)


class Screen:
    """What the person sees and types. `cursor`: the output that ENTER switches."""

    def __init__(self, device: str, bench: Bench) -> None:
        self._device = device
        self._bench = bench
        self._cursor = 0
        self._live = Live(console=Console(), auto_refresh=False, transient=False)

    def __enter__(self) -> "Screen":
        self._live.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._live.stop()

    def draw(self, now: float) -> None:
        """Show everything as it is now (monotonic s)."""
        self._live.update(self._page(now), refresh=True)

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

    def _page(self, now: float) -> Group:
        memory = self._bench.memory
        age = "not read yet" if memory.read_at is None else f"read {now - memory.read_at:.1f} s ago"
        says = Text(memory.why_lost or memory.says, style="bold red")
        return Group(
            Text(f"{self._device}: {age}", style="bold"),
            self._inputs(now),
            Text(self._bench.decoded),
            self._outputs(now),
            says,
            Text(HELP, style="dim"),
        )

    def _inputs(self, now: float) -> Table:
        table = Table("input", "wire", "level", "means", "for", "seen")
        for one in self._bench.inputs:
            table.add_row(*_row(one, now), style="bold" if one.asserted else "")
        return table

    def _outputs(self, now: float) -> Table:
        memory = self._bench.memory
        table = Table("", "output", "what it does", "is", "should be seen", "seen")
        for i, step in enumerate(self._bench.steps):
            on = i == memory.on
            is_now = f"ON, {max(0.0, memory.off_at - now):.0f} s" if on else "off"
            mark = ">" if i == self._cursor else ""
            seen = memory.results.get(i, "")
            table.add_row(
                mark,
                step.name,
                step.does,
                is_now,
                step.expects,
                seen,
                style="bold yellow" if on else "",
            )
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
