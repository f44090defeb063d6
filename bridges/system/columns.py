"""Tables for a terminal."""

import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from itertools import zip_longest


def aligned(rows: Sequence[Sequence[str]], columns: int | None = None) -> list[str]:
    """Return rows of equal length as lines, with two spaces between columns. If lines would be longer
    than `columns`, cells of the widest columns are wrapped between words."""
    columned = [*zip(*rows, strict=True)]
    widths = [max(map(width, column)) for column in columned]
    if columns is not None:
        words = [
            max(width(w) for cell in column for w in cell.split() or [""]) for column in columned
        ]
        widths = _fitted(widths, words, columns - 2 * (len(widths) - 1))
    return [line for row in rows for line in _row(row, widths)]


def _fitted(widths: Sequence[int], words: Sequence[int], columns: int) -> list[int]:
    """Return the widths, the widest cut back until all fit into `columns`, but no word is cut."""
    for most in range(max(widths), 0, -1):
        fitted = [min(w, max(most, word)) for w, word in zip(widths, words, strict=True)]
        if sum(fitted) <= columns:
            break
    return fitted


def _row(row: Sequence[str], widths: Sequence[int]) -> Iterator[str]:
    cells = [
        [cell] if width(cell) <= columns else wrapped(cell, columns + 1)
        for cell, columns in zip(row, widths, strict=True)
    ]
    for line in zip_longest(*cells, fillvalue=""):
        padded = (c + " " * (w - width(c)) for c, w in zip(line, widths, strict=True))
        yield "  ".join(padded).rstrip()


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
