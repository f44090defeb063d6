"""The GPIO chip of a Raspberry Pi's header. gpio-sim simulates it, and a trace keeps every write.

Sources are the kernel's admin-guide/gpio/gpio-sim.rst and its trace events of the group `gpio`. If a
process dies, gpio-sim sets the process's outputs to low. So after a death the level proves nothing.
Only a traced write proves that a daemon has switched the output off.
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
"""The label of each GPIO header's chip, with its number of lines. bcm2835 is the chip of a Raspberry Pi
3 or older, rp1 of a Raspberry Pi 5, and bcm2711 of a Raspberry Pi 4."""
PI_4: Final = "pinctrl-bcm2711"
OTHER: Final = "raspberrypi-exp-gpio"
"""The label of a second chip. It gets the lower chip number, so a daemon must not take the first chip
for the header."""


@dataclass(frozen=True, slots=True)
class Write:
    """A write to a line, with its time (s, monotonic clock)."""

    at: float
    line: int
    level: int


def main() -> int:
    """Prepare the header at boot. Start the trace first, so that it misses no write."""
    watch()
    plug(PI_4)
    return 0


def plug(label: str) -> None:
    """Make the header's chip and a second chip."""
    for bank, name, lines in (("other", OTHER, 8), ("bank0", label, LABELS[label])):
        folder = CONFIGFS / bank
        folder.mkdir(parents=True)
        (folder / "num_lines").write_text(str(lines))
        (folder / "label").write_text(name)
    (CONFIGFS / "live").write_text("1")


def unplug() -> None:
    """Remove both chips."""
    (CONFIGFS / "live").write_text("0")
    for folder in (*CONFIGFS.glob("*/num_lines"),):
        folder.parent.rmdir()
    CONFIGFS.rmdir()
    _lines.cache_clear()


@cache
def _lines() -> Path:
    """Return the directory of the header's chip."""
    device = (CONFIGFS / "dev_name").read_text().strip()
    chip = (CONFIGFS / "bank0/chip_name").read_text().strip()
    return Path(f"/sys/devices/platform/{device}/{chip}")


def line(number: int) -> Path:
    """Return the directory of a line. Its file `pull` sets an input's level, and its file `value` shows
    a level."""
    return _lines() / f"sim_gpio{number}"


def level(number: int) -> bool:
    """Return the level of a line."""
    return (line(number) / "value").read_text().strip() == "1"


def pull(number: int, high: bool) -> None:
    """Set the level of an input."""
    wire, wanted = line(number) / "pull", "pull-up" if high else "pull-down"
    if wire.read_text().strip() != wanted:
        wire.write_text(wanted)


def watch() -> None:
    """Trace each write of a line with its time."""
    (TRACING / "trace_clock").write_text("mono")
    event = TRACING / "events/gpio/gpio_value"
    (event / "filter").write_text("get == 0")
    (event / "enable").write_text("1")


def writes(since: float = 0.0) -> list[Write]:
    """Return every write since this time, in order."""
    return [each for each in _traced() if each.at >= since]


def _traced() -> Iterator[Write]:
    base = _base()
    for text in (TRACING / "trace").read_text().splitlines():
        if found := re.search(r" ([0-9.]+): gpio_value: (\d+) set (-?\d+)", text):
            yield Write(float(found[1]), int(found[2]) - base, int(found[3]))


def _base() -> int:
    """Return the number of the chip's first line in the kernel's trace."""
    label = (CONFIGFS / "bank0/label").read_text().strip()
    chips = Path("/sys/class/gpio").glob("gpiochip*")
    ours = (c for c in chips if (c / "label").read_text().strip() == label)
    return next(int((c / "base").read_text()) for c in ours)


def on(lines: dict[int, bool], since: float = 0.0) -> dict[int, float]:
    """Return the outputs whose last write was "on", with the time of that write (s). `lines` has the
    level for "on" of each line."""
    last = {each.line: each for each in writes(since)}
    return {n: last[n].at for n, high in lines.items() if n in last and last[n].level == high}


def together(lines: Mapping[int, bool]) -> list[set[int]]:
    """Return the sets of outputs that were on together, in order. Only the outputs in `lines` count.
    The list begins when the chip was made, with an empty set."""
    found: list[set[int]] = [set()]
    for each in writes():
        if each.line in lines:
            others = found[-1] - {each.line}
            on = others | {each.line} if each.level == lines[each.line] else others
            if on != found[-1]:
                found.append(on)
    return found


def off_at(lines: Mapping[int, bool], after: float) -> dict[int, float]:
    """Return the first time (s, monotonic clock) later than `after` at which each line was written
    off."""
    found: dict[int, float] = {}
    for each in writes(after):
        if each.line in lines and each.level != lines[each.line]:
            found.setdefault(each.line, each.at)
    return found


def now() -> float:
    """Return the time of the clock that the trace uses."""
    return time.monotonic()


if __name__ == "__main__":
    sys.exit(main())
