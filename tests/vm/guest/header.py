"""The chip of a Raspberry Pi's header, simulated by gpio-sim, and every write to its outputs.

Kernel documentation: admin-guide/gpio/gpio-sim.rst, and trace events of the group `gpio`. gpio-sim
lets an output fall when its line is released, so a level proves nothing after a death: a write does.
"""

import re
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

CONFIGFS: Final = Path("/sys/kernel/config/gpio-sim/header")
TRACING: Final = Path("/sys/kernel/tracing")
LABELS: Final = {"pinctrl-bcm2835": 54, "pinctrl-rp1": 54, "pinctrl-bcm2711": 58}
"""Chips of the header, and their lines: Raspberry Pi 3 and older, 5, 4."""
PI_4: Final = "pinctrl-bcm2711"
OTHER: Final = "raspberrypi-exp-gpio"
"""A chip that is not the header's, and gets the lower number here."""


@dataclass(frozen=True, slots=True)
class Write:
    """A line was written at this time (monotonic s)."""

    at: float
    line: int
    level: int


def main() -> int:
    """At boot: watch first, so that no write is missed."""
    watch()
    plug(PI_4)
    return 0


def plug(label: str) -> None:
    """Make the chip, beside another one."""
    for bank, name, lines in (("other", OTHER, 8), ("bank0", label, LABELS[label])):
        folder = CONFIGFS / bank
        folder.mkdir(parents=True)
        (folder / "num_lines").write_text(str(lines))
        (folder / "label").write_text(name)
    (CONFIGFS / "live").write_text("1")


def unplug() -> None:
    """Take both away."""
    (CONFIGFS / "live").write_text("0")
    for folder in (*CONFIGFS.glob("*/num_lines"),):
        folder.parent.rmdir()
    CONFIGFS.rmdir()
    _lines.cache_clear()


@cache
def _lines() -> Path:
    """The directory of the chip that is plugged."""
    device = (CONFIGFS / "dev_name").read_text().strip()
    chip = (CONFIGFS / "bank0/chip_name").read_text().strip()
    return Path(f"/sys/devices/platform/{device}/{chip}")


def line(number: int) -> Path:
    """The directory of a line: `pull` sets what an input reads, `value` shows a level."""
    return _lines() / f"sim_gpio{number}"


def level(number: int) -> bool:
    """The level of a line."""
    return (line(number) / "value").read_text().strip() == "1"


def pull(number: int, high: bool) -> None:
    """What an input reads from now on."""
    wire, wanted = line(number) / "pull", "pull-up" if high else "pull-down"
    if wire.read_text().strip() != wanted:
        wire.write_text(wanted)


def watch() -> None:
    """Write down each write of a line, with its time."""
    (TRACING / "trace_clock").write_text("mono")
    event = TRACING / "events/gpio/gpio_value"
    (event / "filter").write_text("get == 0")
    (event / "enable").write_text("1")


def writes(since: float = 0.0) -> list[Write]:
    """Every write since then, in turn."""
    return [each for each in _traced() if each.at >= since]


def _traced() -> Iterator[Write]:
    base = _base()
    for text in (TRACING / "trace").read_text().splitlines():
        if found := re.search(r" ([0-9.]+): gpio_value: (\d+) set (-?\d+)", text):
            yield Write(float(found[1]), int(found[2]) - base, int(found[3]))


def _base() -> int:
    """The number that the kernel's trace gives to the chip's first line."""
    label = (CONFIGFS / "bank0/label").read_text().strip()
    chips = Path("/sys/class/gpio").glob("gpiochip*")
    ours = (c for c in chips if (c / "label").read_text().strip() == label)
    return next(int((c / "base").read_text()) for c in ours)


def on(lines: dict[int, bool], since: float = 0.0) -> dict[int, float]:
    """Outputs that the last write has left on, and since when. `lines`: each with its level for on."""
    last = {each.line: each for each in writes(since)}
    return {n: last[n].at for n, high in lines.items() if n in last and last[n].level == high}


def together(lines: Mapping[int, bool]) -> list[set[int]]:
    """Which of these outputs have been on together, in turn since the chip was plugged."""
    found: list[set[int]] = [set()]
    for each in writes():
        if each.line in lines:
            others = found[-1] - {each.line}
            on = others | {each.line} if each.level == lines[each.line] else others
            if on != found[-1]:
                found.append(on)
    return found


def off_at(lines: Mapping[int, bool], after: float) -> dict[int, float]:
    """When each of these lines was first written off after that time (monotonic s)."""
    found: dict[int, float] = {}
    for each in writes(after):
        if each.line in lines and each.level != lines[each.line]:
            found.setdefault(each.line, each.at)
    return found


def now() -> float:
    """The trace's clock."""
    return time.monotonic()


if __name__ == "__main__":
    sys.exit(main())
