"""Figures as tables. A table has a title, named rows and named columns."""

import statistics
from collections.abc import Sequence

Row = dict[str, float]
Rows = dict[str, Row]
Tables = dict[str, Rows]


def percentiles(values: Sequence[float]) -> tuple[float, float]:
    """Return p50 and p99."""
    cuts = statistics.quantiles(values, n=100, method="inclusive")
    return cuts[49], cuts[98]


def compared(seconds: Sequence[float], bare: Sequence[float]) -> Row:
    """Return times (ms), and the ratio to the bare node's times."""
    (p50, p99), (bare50, bare99) = percentiles(seconds), percentiles(bare)
    return {
        "p50 ms": p50 * 1e3,
        "p99 ms": p99 * 1e3,
        "p50 ratio": p50 / bare50,
        "p99 ratio": p99 / bare99,
    }


def each_more(rows: Rows, counts: Sequence[int]) -> Row:
    """Return the cost of each further device. The cost is computed from the first and the last row."""
    first, *_, last = rows.values()
    more = counts[-1] - counts[0]
    return {key: (last[key] - first[key]) / more for key in ("RSS MB", "CPU %")}


def lines(title: str, rows: Rows) -> list[str]:
    """Return the lines of a table."""
    headings = list(dict.fromkeys(heading for row in rows.values() for heading in row))
    table = [f"{title:42}" + "".join(f"{heading:>12}" for heading in headings)]
    for name, row in rows.items():
        cells = (f"{row[h]:>12.3f}" if h in row else f"{'':12}" for h in headings)
        table.append(f"{name:42}" + "".join(cells).rstrip())
    return table
