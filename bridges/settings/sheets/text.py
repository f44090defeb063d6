"""The findings about a file, as lines for a terminal."""

from collections.abc import Iterator, Mapping, Sequence

from bridges.kinds.shared.table import Table
from bridges.settings.sheets.findings import MEANINGS, WIRES, Findings, Part
from bridges.system.columns import aligned, hanging


def lines(findings: Findings, columns: int) -> list[str]:
    """Return a valid file's findings as lines of at most `columns` characters. The lines show kind and
    driver, and then the wiring or the messages."""
    driver = f", driver {findings.driver}" if findings.driver else ""
    return [
        f"{findings.file}: {findings.kind}{driver}",
        *hanging(f"RMF: {_pairs(findings.rmf, '; ')}", columns),
        "",
        *_body(findings, columns),
        *_notes(findings, columns),
    ]


def _body(findings: Findings, columns: int) -> Iterator[str]:
    for bus in findings.buses:
        settings = f": {_pairs(bus.settings)}" if bus.settings else ""
        yield from hanging(f"bus {bus.name} ({bus.type}){settings}", columns)
        yield from _wiring([part for part in findings.parts if part.bus == bus.name], columns)
        yield ""
        for table in bus.tables:
            yield f"bus {bus.name}: {table.title}"
            yield from [*_table(table, columns), ""]
    yield from _tables(findings.parts, columns)


def _pairs(settings: Mapping[str, str], between: str = ", ") -> str:
    return between.join(f"{key} {text}" for key, text in settings.items())


def _wiring(parts: Sequence[Part], columns: int) -> Iterator[str]:
    """Yield one table with the wires of all devices of a bus. For devices without wires, yield a table
    with their messages on the bus."""
    for title in (WIRES, MEANINGS):
        found = [(p.device, table) for p in parts for table in p.tables if table.title == title]
        headings = [("device", *table.headings) for _, table in found[:1]]
        rows = [(device, *row) for device, table in found for row in table.rows]
        yield from _indented([*headings, *rows], columns) if rows else []


def _tables(parts: Sequence[Part], columns: int) -> Iterator[str]:
    """Yield all other tables. A table that several devices share appears once."""
    alike: dict[Table, list[str]] = {}
    for part in parts:
        for table in part.tables:
            if table.title not in (WIRES, MEANINGS):
                alike.setdefault(table, []).append(part.device)
    for table, devices in alike.items():
        yield from hanging(f"{', '.join(devices)}: {table.title}", columns)
        yield from _table(table, columns)
        yield ""


def _table(table: Table, columns: int) -> list[str]:
    """Return the lines of a table. Columns that are empty in every row are left out."""
    filled = table.filled()
    return _indented([filled.headings, *filled.rows], columns)


def _indented(rows: Sequence[Sequence[str]], columns: int) -> list[str]:
    return [f"  {line}" for line in aligned(rows, columns - 2)]


def _notes(findings: Findings, columns: int) -> list[str]:
    found = [line for note in findings.notes for line in hanging(note, columns)]
    return [*found, ""] if found else []
