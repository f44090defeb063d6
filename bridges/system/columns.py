"""Tables for a terminal."""

import shutil
import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from typing import TextIO


def aligned(rows: Sequence[Sequence[str]], columns: int | None = None) -> list[str]:
    """Return rows with equal numbers of cells as lines, with two spaces between the columns of the
    table.

    If a line would be longer than `columns` characters, the cells of the widest columns are wrapped
    between words. If the lines are still too long, only one space stands between columns, and long
    words are cut.
    """
    columned = [*zip(*rows, strict=True)]
    widths, gap = [max(map(width, column)) for column in columned], 2
    if columns is not None:
        words = [
            max(width(w) for cell in column for w in cell.split() or [""]) for column in columned
        ]
        between = len(widths) - 1
        if sum(map(min, widths, words)) + gap * between > columns:
            gap = 1
        widths = _fitted(widths, words, columns - gap * between)
    return [line for row in rows for line in _row(row, widths, " " * gap)]


def _fitted(widths: Sequence[int], words: Sequence[int], columns: int) -> list[int]:
    """Return the widths for the table's columns. Reduce the widest ones until their sum is at most
    `columns` characters. Cut a word only if the table would otherwise not fit."""
    for least in (words, [1] * len(words)):
        for most in range(max(widths), 0, -1):
            fitted = [min(w, max(most, one)) for w, one in zip(widths, least, strict=True)]
            if sum(fitted) <= columns:
                return fitted
    return fitted


def _row(row: Sequence[str], widths: Sequence[int], gap: str) -> Iterator[str]:
    cells = [
        [cell] if width(cell) <= columns else wrapped(cell, columns + 1)
        for cell, columns in zip(row, widths, strict=True)
    ]
    for line in zip_longest(*cells, fillvalue=""):
        padded = (c + " " * (w - width(c)) for c, w in zip(line, widths, strict=True))
        yield gap.join(padded).rstrip()


def width(text: str) -> int:
    """Return the text's width in terminal columns. A character such as 走 takes two columns."""
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


def hanging(text: str, columns: int, indent: int = 2) -> list[str]:
    """Return the text in lines of at most `columns`. All lines but the first are indented."""
    first, *more = wrapped(text, columns + 1)
    rest = wrapped(" ".join(more), columns + 1 - indent) if more else []
    return [first, *(" " * indent + line for line in rest)]


def columns_of(out: TextIO) -> int:
    """Return the width of a stream's terminal. Return 0 for a pipe or file, whose lines may have any
    length."""
    return shutil.get_terminal_size().columns if out.isatty() else 0
