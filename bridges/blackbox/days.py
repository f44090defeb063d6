"""Daily counts of this machine's devices: rides, waits, availability, door cycles and energy.

The recorder reads the counts from the rings. It keeps them in one small file, `days.json` in the folder
of recordings. Each device is counted only from the ring of its own daemon, so nothing counts twice.
"""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import date, timedelta
from pathlib import Path
from typing import Final

import msgspec

from bridges.observe.all_devices import Key
from bridges.observe.tally import DeviceCounts
from bridges.system import files

FILE: Final = "days.json"
MOST_DAYS: Final = 60
MOST_BYTES: Final = 8 << 20
HEADINGS: Final = (
    "kind",
    "device",
    "rides",
    "waits",
    "wait p50 s",
    "wait p95 s",
    "door cycles",
    "charges",
    "energy Wh",
    "in service %",
    "watched h",
)

Days = dict[str, dict[str, DeviceCounts]]
"""Counts by day (`2026-11-24`), and within a day by `<kind> <device>`."""


class DayRow(msgspec.Struct, frozen=True):
    """A table row for one device over one or more days.

    `cells` has the order of HEADINGS. A cell is "" if its value is unknown or the device's kind has no
    such value.
    """

    cells: tuple[str, ...]


def read(folder: Path) -> Days:
    """Read the file. Return no days if the file is missing or unreadable."""
    with suppress(OSError, msgspec.MsgspecError):
        return msgspec.json.decode(files.read(folder / FILE, MOST_BYTES), type=Days)
    return {}


def add(folder: Path, day: date, counts: Mapping[Key, DeviceCounts]) -> None:
    """Add the counts to the day `day` in the file, and keep only the last MOST_DAYS days. Raises
    OSError."""
    counted = {key: one for key, one in counts.items() if one.watched_s}
    if not counted:
        return
    days = read(folder)
    today = days.setdefault(day.isoformat(), {})
    for (kind, name), one in counted.items():
        today.setdefault(f"{kind} {name}", DeviceCounts()).add(one)
    kept = dict(sorted(days.items())[-MOST_DAYS:])
    files.replace(folder / FILE, msgspec.json.encode(kept))


def rows(days: Days, last: date, count: int) -> list[DayRow]:
    """Return a row for each device. A row sums up the `count` days that end with `last`. Rows are
    sorted by kind and name."""
    wanted = {(last - timedelta(back)).isoformat() for back in range(count)}
    found: dict[str, DeviceCounts] = {}
    for day in wanted & days.keys():
        for name, one in days[day].items():
            found.setdefault(name, DeviceCounts()).add(one)
    return [_row(name, found[name]) for name in sorted(found)]


def as_csv(days: Days) -> str:
    """Return every day of every device as CSV (RFC 4180). The first line holds the headings."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(("day", *HEADINGS))
    writer.writerows(_lines(days))
    return out.getvalue()


def _lines(days: Days) -> Iterator[Iterable[str]]:
    for day in sorted(days):
        for row in rows(days, date.fromisoformat(day), 1):
            yield day, *row.cells


def _row(name: str, one: DeviceCounts) -> DayRow:
    kind, _, device = name.partition(" ")
    waits = one.waits if one.waits.total else None
    cells = (
        kind,
        device,
        str(one.rides.total) if kind == "lift" else "",
        str(one.waits.total) if waits else "",
        _at_most(waits.quantile(0.5)) if waits else "",
        _at_most(waits.quantile(0.95)) if waits else "",
        str(one.cycles) if kind in ("lift", "door") else "",
        str(one.cycles) if kind == "charger" else "",
        f"{one.energy_j / 3600:.0f}" if one.energy_j else "",
        f"{100 * one.served_s / one.watched_s:.1f}" if one.watched_s else "",
        f"{one.watched_s / 3600:.1f}",
    )
    return DayRow(cells)


def _at_most(bound_s: float | None) -> str:
    """Return the upper bound of a wait's bucket as text. A wait of 12 s gives `≤ 20`."""
    return "" if bound_s is None else ("> 600" if bound_s == float("inf") else f"≤ {bound_s:g}")
