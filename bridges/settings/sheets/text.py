"""The findings about a file, as lines for a terminal."""

from collections.abc import Iterator, Sequence

from bridges.kinds.shared.table import Table
from bridges.settings.sheets.findings import MEANINGS, WIRES, BusShown, Findings, Part
from bridges.system.columns import aligned


def lines(findings: Findings) -> list[str]:
    """Return a valid file's kind and driver, its wiring or messages, and a blank line at the end."""
    driver = f", driver {findings.driver}" if findings.driver else ""
    return [f"{findings.file}: {findings.kind}{driver}", "", *_body(findings), *_notes(findings)]


def _body(findings: Findings) -> Iterator[str]:
    for bus in findings.buses:
        yield _bus(bus)
        yield from _wiring([part for part in findings.parts if part.bus == bus.name])
        yield ""
    yield from _tables(findings.parts)


def _bus(bus: BusShown) -> str:
    settings = ", ".join(f"{key} {text}" for key, text in bus.settings.items())
    return f"bus {bus.name} ({bus.type}){f': {settings}' if settings else ''}"


def _wiring(parts: Sequence[Part]) -> Iterator[str]:
    """Yield the wires of all devices of a bus in one table; then the meanings for other devices."""
    for title in (WIRES, MEANINGS):
        found = [(p.device, table) for p in parts for table in p.tables if table.title == title]
        headings = [("device", *table.headings) for _, table in found[:1]]
        rows = [(device, *row) for device, table in found for row in table.rows]
        yield from _indented([*headings, *rows]) if rows else []


def _tables(parts: Sequence[Part]) -> Iterator[str]:
    """Yield the other tables. Equal tables of several devices are printed once."""
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
    """Return the lines of a table, without columns that are empty in every row."""
    filled = table.filled()
    return _indented([filled.headings, *filled.rows])


def _indented(rows: Sequence[Sequence[str]]) -> list[str]:
    return [f"  {line}" for line in aligned(rows)]


def _notes(findings: Findings) -> list[str]:
    return [*findings.notes, ""] if findings.notes else []
