"""The commissioning sheet: an HTML file to print, tick and sign, with a page for each controller.

It needs no other file. Texts from a YAML are escaped, never markup.
"""

from collections.abc import Iterable, Iterator, Sequence
from html import escape

from bridges.commands.sheets.told import BusTold, Part, Told
from bridges.core.table import Table
from bridges.settings.nodes import Problem

STYLE = """
body { font: 10pt/1.35 sans-serif; margin: 1.5em; color: #000; background: #fff; }
section { page-break-after: always; break-after: page; }
section:last-of-type { page-break-after: auto; break-after: auto; }
h1 { font-size: 15pt; margin: 0 0 .2em; } h2 { font-size: 11pt; margin: 1.1em 0 .3em; }
p { margin: .2em 0; } .file { font-family: monospace; font-size: 8pt; word-break: break-all; }
table { border-collapse: collapse; width: 100%; } tr { break-inside: avoid; }
th, td { border: 1px solid #888; padding: .15em .4em; text-align: left; vertical-align: top; }
th { background: #eee; } .box { width: 3em; text-align: center; } .seen { width: 12em; }
.warning { border-left: 4px solid #000; padding-left: .6em; }
.sign td { height: 2.6em; width: 33%; font-size: 8pt; }
@page { size: A4; margin: 14mm; } @media print { body { margin: 0; } }
"""
BOX = '<td class="box">&#9744;</td>'
TO_TRY = (
    "every output is off while the unit is off, and after the machine has started",
    "every output is off 10 s after the daemon was killed (kill -9)",
    "the network is unplugged: RMF is told, and every output is as the settings say",
)


def page(files: Sequence[Told]) -> str:
    """The whole file."""
    sections = (_section(told, part) for told in files for part in told.parts)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f"<title>Commissioning sheet</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        f"{''.join(sections)}</body>\n</html>\n"
    )


def _section(told: Told, part: Part) -> str:
    bus = next((bus for bus in told.buses if bus.name == part.bus), None)
    lines = [
        *_head(told, part),
        *(_bus(bus) if bus else ()),
        *_warnings(told.warnings),
        *(line for table in part.tables for line in _table(table)),
        *_trials(part),
        *_signatures(),
    ]
    return "<section>\n" + "\n".join(lines) + "\n</section>\n"


def _head(told: Told, part: Part) -> Iterator[str]:
    driver = f", driver {told.driver}" if told.driver else ""
    yield f"<h1>{escape(part.device)}: {escape(told.kind + driver)}</h1>"
    yield f'<p class="file">{escape(told.file)}<br>SHA-256 {escape(told.sha256)}</p>'


def _bus(bus: BusTold) -> Iterator[str]:
    yield from _table(
        Table(f"bus {bus.name} ({bus.type})", ("setting", "value"), tuple(bus.settings.items()))
    )


def _warnings(warnings: Iterable[Problem]) -> Iterator[str]:
    """All warnings of the file, on each page: each controller's page is signed by itself."""
    for warning in warnings:
        text = f"line {warning.line}: {warning.text.removeprefix('warning: ')}"
        yield f'<p class="warning">&#9744; {escape(text)}</p>'


def _table(table: Table) -> Iterator[str]:
    """A table with a box to tick in each row, and room for what was seen."""
    headings = "".join(f"<th>{escape(heading)}</th>" for heading in table.headings)
    yield f"<h2>{escape(table.title)}</h2>"
    yield f'<table>\n<tr>{headings}<th class="seen">seen</th><th class="box">right</th></tr>'
    for row in table.rows:
        cells = "".join(f"<td>{escape(cell)}</td>" for cell in row)
        yield f"<tr>{cells}<td></td>{BOX}</tr>"
    yield "</table>"


def _trials(part: Part) -> Iterator[str]:
    """Trials on the controller itself."""
    if part.bus:
        yield from _table(Table("to be tried", ("trial",), tuple((trial,) for trial in TO_TRY)))


def _signatures() -> Iterator[str]:
    cells = "".join(f"<td>{escape(what)}</td>" for what in ("date", "name", "signature"))
    yield f'<h2>signed</h2>\n<table class="sign"><tr>{cells}</tr><tr>{cells}</tr></table>'
