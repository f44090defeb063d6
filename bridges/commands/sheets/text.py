"""What is told of a file, as lines for a terminal."""

import unicodedata
from collections.abc import Iterator, Sequence

from bridges.commands.sheets.told import MEANINGS, WIRES, BusTold, Part, Told
from bridges.core.table import Table


def lines(told: Told) -> list[str]:
    """A file that could be read: what it is, and its wiring or what it talks to; a blank line last."""
    driver = f", driver {told.driver}" if told.driver else ""
    return [f"{told.file}: {told.kind}{driver}", "", *_body(told), *_notes(told)]


def _body(told: Told) -> Iterator[str]:
    for bus in told.buses:
        yield _bus(bus)
        yield from _wiring([part for part in told.parts if part.bus == bus.name])
        yield ""
    yield from _tables(told.parts)


def _bus(bus: BusTold) -> str:
    settings = ", ".join(f"{key} {text}" for key, text in bus.settings.items())
    return f"bus {bus.name} ({bus.type}){f': {settings}' if settings else ''}"


def _wiring(parts: Sequence[Part]) -> Iterator[str]:
    """The wires of all devices of a bus under one heading; then what those say that have none."""
    for title in (WIRES, MEANINGS):
        found = [(p.device, table) for p in parts for table in p.tables if table.title == title]
        headings = [("device", *table.headings) for _, table in found[:1]]
        rows = [(device, *row) for device, table in found for row in table.rows]
        yield from aligned([*headings, *rows]) if rows else []


def _tables(parts: Sequence[Part]) -> Iterator[str]:
    """The other tables; what several devices have alike is printed once."""
    alike: dict[Table, list[str]] = {}
    for part in parts:
        for table in part.tables:
            if table.title not in (WIRES, MEANINGS):
                alike.setdefault(table, []).append(part.device)
    for table, devices in alike.items():
        yield f"{', '.join(devices)}: {table.title}"
        yield from _table(table)
        yield ""


def _table(table: Table) -> list[str]:
    """Its lines; a column that is empty in every row is left out."""
    filled = table.filled()
    return aligned([filled.headings, *filled.rows])


def _notes(told: Told) -> list[str]:
    return [*told.notes, ""] if told.notes else []


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of equal length as lines with their columns under each other."""
    widths = [max(map(_width, column)) for column in zip(*rows, strict=True)]
    return [
        "".join(f"  {c}{' ' * (w - _width(c))}" for c, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _width(text: str) -> int:
    """Columns on a terminal: 走 takes two."""
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)
