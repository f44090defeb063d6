"""Tables for a terminal."""

import textwrap
import unicodedata
from collections.abc import Sequence


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows of equal length as lines, with two spaces between columns."""
    widths = [max(map(width, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(c + " " * (w - width(c)) for c, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def width(text: str) -> int:
    """Return the text's width in terminal columns: 走 takes two."""
    return sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in text)


def clipped(text: str, columns: int) -> str:
    """Return the beginning of the text that fits into `columns`."""
    while width(text) > columns:
        text = text[:-1]
    return text


def wrapped(text: str, columns: int) -> list[str]:
    """Return the text in lines that fit into `columns`."""
    counted = "".join(f"{c}\0" if width(c) == 2 else c for c in text)  # textwrap counts characters
    return [line.replace("\0", "") for line in textwrap.wrap(counted, columns - 1)] or [""]
