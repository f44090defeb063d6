"""A device's wiring and limits as HTML tables, from its YAML."""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from html import escape
from pathlib import Path

from bridges.kinds.shared.table import Table
from bridges.settings.load import SettingsError, load
from bridges.settings.sheets.findings import SETTINGS, WIRES, findings

NO_RING = (
    "There are no live levels: the device's daemon keeps no ring file, or the page's user may not read"
    " the file."
)


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], caption: str) -> str:
    """Return an HTML table. The text of every cell is escaped."""
    heads = "".join(f'<th scope="col">{escape(text)}</th>' for text in headings)
    body = "".join(
        f"<tr>{''.join(_cell(*pair) for pair in zip(headings, row, strict=True))}</tr>"
        for row in rows
    )
    return (
        f"<table><caption>{escape(caption)}</caption>"
        f"<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
    )


def _cell(heading: str, cell: str) -> str:
    """Format a cell with its heading, for narrow screens. A narrow screen hides empty cells."""
    none = ' class="none"' if cell in ("-", "") and heading != "now" else ""
    return f'<td data-head="{escape(heading)}"{none}>{escape(cell)}</td>'


def wiring(file: str, device: str, contacts: Mapping[str, bool]) -> str:
    """Return the tables of wires and limits from the device's YAML, as `rmf-bridge check` prints them.

    `contacts` is known signal -> whether the signal is asserted. The table of wires shows these values
    in a column.
    """
    found = _tables(file, _changed_at(file), device)
    if isinstance(found, str):
        return f"<p>{escape(found)}</p>"
    live = (_live(one, contacts) if one.title == WIRES else one for one in found)
    return "".join(map(_folded, live))


def _folded(one: Table) -> str:
    """Format a table. Settings with default values are hidden until the reader unfolds the table."""
    if one.headings != SETTINGS:
        return table(one.headings, one.rows, one.title)
    set_, rest = ([row for row in one.rows if bool(row[2]) == own] for own in (True, False))
    shown = table(SETTINGS, set_, one.title) if set_ else ""
    if not rest:
        return shown
    folded = f"{len(rest)} {one.title} at their defaults"
    inner = table(SETTINGS[:2], [row[:2] for row in rest], folded)
    return f"{shown}<details><summary>{folded}</summary>{inner}</details>"


def _live(wires: Table, contacts: Mapping[str, bool]) -> Table:
    active = wires.headings.index("active")
    rows = tuple((row[0], _now(contacts.get(row[0]), row[active]), *row[1:]) for row in wires.rows)
    return Table(wires.title, (wires.headings[0], "now", *wires.headings[1:]), rows)


def _now(asserted: bool | None, active: str) -> str:
    if asserted is None:
        return "? not known"
    level = "high" if asserted == (active == "high") else "low"
    return f"{'● asserted' if asserted else '○ not asserted'} ({level})"


def levels(sensed: Mapping[str, str], driven: Mapping[str, str]) -> str:
    """Return a daemon's present inputs and outputs as tables."""
    if not sensed and not driven:
        return f"<p>{NO_RING}</p>"
    rows = [(name, "sensed", value) for name, value in sensed.items()]
    rows += [(name, "driven", value) for name, value in driven.items()]
    return table(("what", "way", "now"), rows, "Levels now, as sensed and driven")


def _changed_at(file: str) -> float:
    try:
        return Path(file).stat().st_mtime
    except OSError:
        return 0.0


@lru_cache(maxsize=64)
def _tables(file: str, changed_at: float, device: str) -> list[Table] | str:
    """Return the tables. If there are none, return the reason. A new `changed_at` makes this function
    read the file again."""
    try:
        config = load(Path(file))
    except SettingsError as error:
        return f"{file} cannot be read: {error.problems[0]}"
    parts = [part for part in findings(config).parts if part.device in (device, config.kind)]
    return [one for part in parts for one in part.tables]
