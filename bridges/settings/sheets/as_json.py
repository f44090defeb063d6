"""The findings as JSON. Each row of a table becomes an object whose keys are the table's headings."""

from collections.abc import Sequence

import msgspec

from bridges.kinds.shared.table import Table
from bridges.settings.sheets.findings import Findings


def document(files: Sequence[Findings], errors: int, warnings: int) -> str:
    """Return `{"ok": true, "errors": 0, "warnings": 0, "files": [...]}`, with a newline at the end."""
    found = {
        "ok": not errors,
        "errors": errors,
        "warnings": warnings,
        "files": [*map(_file, files)],
    }
    return msgspec.json.format(msgspec.json.encode(found), indent=2).decode() + "\n"


def _file(findings: Findings) -> dict[str, object]:
    parts = [
        {"device": part.device, "bus": part.bus, "tables": [*map(_table, part.tables)]}
        for part in findings.parts
    ]
    buses = [
        {**msgspec.structs.asdict(b), "tables": [*map(_table, b.tables)]} for b in findings.buses
    ]
    return {**msgspec.structs.asdict(findings), "parts": parts, "buses": buses}


def _table(table: Table) -> dict[str, object]:
    rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
    return {"title": table.title, "rows": rows}
