"""The commissioning sheet: an HTML file to print, tick and sign. Each controller has its own page.

The HTML file loads no other file. Texts from a YAML are escaped, so they cannot be markup.
"""

from collections.abc import Iterator, Mapping, Sequence
from html import escape

from bridges.kinds.shared.table import Table
from bridges.settings.sheets.findings import MEANINGS, WIRES, BusShown, Findings, Part

STYLE = """
body { font: 8pt/1.2 sans-serif; margin: 1.5em; color: #000; background: #fff; }
section { page-break-after: always; break-after: page; }
section:last-of-type { page-break-after: auto; break-after: auto; }
h1 { font-size: 12pt; margin: 0 0 .2em; } h2 { font-size: 9pt; margin: .7em 0 .2em; }
h2 { break-after: avoid; }
p { margin: .2em 0; } .file { font-family: monospace; font-size: 7pt; word-break: break-all; }
table { border-collapse: collapse; width: calc(100% - 1px); } tr { break-inside: avoid; }
th, td { border: 1px solid #888; padding: 0 .3em; text-align: left; vertical-align: top; }
td { overflow-wrap: anywhere; }
th { background: #eee; } .box { width: 2.2em; text-align: center; } .seen { min-width: 6em; }
.short { white-space: nowrap; } .warning { border-left: 4px solid #000; padding-left: .6em; }
.narrow { columns: 2; column-gap: 1.2em; margin-top: .7em; padding-right: 1px; }
.narrow div { break-inside: avoid; } .narrow h2 { margin-top: 0; }
.narrow table { margin-bottom: .7em; }
.trials { break-inside: avoid; } .sign td { height: 2.2em; width: 33%; font-size: 7pt; }
@page { size: A4; margin: 9mm; } @media print { body { margin: 0; } }
"""
BOX = '<td class="box">&#9744;</td>'
SHORT = 12
"""The greatest length (characters) of a cell that is not broken into lines."""
NARROW = 60
"""The greatest length (characters) of a row in a table that fits in half the page's width."""
TO_TRY = (
    "every output is off while the unit is off, and after the machine has started",
    "every output is off 10 s after the daemon was killed (kill -9)",
    "the controller's cable is unplugged: the device is offline, its outputs are as the settings say",
)


def page(files: Sequence[Findings]) -> str:
    """Return the whole HTML file."""
    sections = (_section(findings, part) for findings in files for part in findings.parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>Commissioning sheet</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"{''.join(sections)}</body>\n</html>\n"
    )


def _section(findings: Findings, part: Part) -> str:
    bus = next((bus for bus in findings.buses if bus.name == part.bus), None)
    of_bus = [_bus(bus), *bus.tables] if bus else []
    tables = [*part.tables[:-1], *of_bus, _settings("RMF", findings.rmf), *part.tables[-1:]]
    lines = [
        *_head(findings, part),
        *_remarks(findings),
        *(line for table in tables if _is_wide(table) for line in _table(table, seen=True)),
        '<div class="narrow">',
        *(line for table in tables if not _is_wide(table) for line in _block(table)),
        '</div>\n<div class="trials">',
        *_trials(part),
        *_signatures(),
        "</div>",
    ]
    return "<section>\n" + "\n".join(lines) + "\n</section>\n"


def _head(findings: Findings, part: Part) -> Iterator[str]:
    driver = f", driver {findings.driver}" if findings.driver else ""
    yield f"<h1>{escape(part.device)}: {escape(findings.kind + driver)}</h1>"
    yield f'<p class="file">{escape(findings.file)}<br>SHA-256 {escape(findings.sha256)}</p>'


def _bus(bus: BusShown) -> Table:
    return _settings(f"bus {bus.name} ({bus.type})", bus.settings)


def _settings(title: str, settings: Mapping[str, str]) -> Table:
    return Table(title, ("setting", "value"), tuple(settings.items()))


def _is_wide(table: Table) -> bool:
    """Return whether the table needs the page's whole width."""
    return table.title in (WIRES, MEANINGS) or max(map(_letters, table.rows), default=0) > NARROW


def _letters(row: Sequence[str]) -> int:
    return sum(map(len, row))


def _remarks(findings: Findings) -> Iterator[str]:
    """Yield all warnings and notes of the file. Each controller's page repeats them, because each page
    is signed on its own."""
    warnings = (f"line {w.line}: {w.text.removeprefix('warning: ')}" for w in findings.warnings)
    for text in (*warnings, *(note.removeprefix(f"{findings.file}:") for note in findings.notes)):
        yield f'<p class="warning">&#9744; {escape(text)}</p>'


def _table(table: Table, seen: bool = False) -> Iterator[str]:
    """Yield a table with a box in each row. With `seen`, add a column for observations."""
    shown = table.filled()
    headings = "".join(f"<th>{escape(heading)}</th>" for heading in shown.headings)
    more = '<th class="seen">seen</th>' if seen else ""
    yield f"<h2>{escape(shown.title)}</h2>"
    yield f'<table>\n<thead><tr>{headings}{more}<th class="box">right</th></tr></thead>'
    for row in shown.rows:
        yield f"<tr>{''.join(map(_cell, row))}{'<td></td>' if seen else ''}{BOX}</tr>"
    yield "</table>"


def _block(table: Table) -> Iterator[str]:
    """Yield a table that is not split between two columns of the page."""
    yield "<div>"
    yield from _table(table)
    yield "</div>"


def _cell(text: str) -> str:
    short = ' class="short"' if len(text) <= SHORT else ""
    return f"<td{short}>{escape(text)}</td>"


def _trials(part: Part) -> Iterator[str]:
    """Yield the trials that a person makes on the controller."""
    if part.bus:
        trials = Table("to be tried", ("trial",), tuple((trial,) for trial in TO_TRY))
        yield from _table(trials, seen=True)


def _signatures() -> Iterator[str]:
    cells = "".join(f"<td>{escape(what)}</td>" for what in ("date", "name", "signature"))
    yield f'<h2>signed</h2>\n<table class="sign"><tr>{cells}</tr><tr>{cells}</tr></table>'
