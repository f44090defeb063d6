"""Colours, and lines that overwrite earlier lines. Colours are used only on a terminal, and only
without NO_COLOR (https://no-color.org)."""

import os
from collections.abc import Iterable
from typing import TextIO


def coloured(out: TextIO) -> bool:
    """Return whether this stream shows colours."""
    return out.isatty() and not os.environ.get("NO_COLOR")


def styled(text: str, style: str) -> str:
    """Return the text in a style. `style`: numbers of ECMA-48's SGR, such as `1;31`, or "" for plain
    text."""
    return f"\x1b[{style}m{text}\x1b[0m" if style else text


def red(text: str, out: TextIO) -> str:
    """Return the text in red, for things that need attention."""
    return styled(text, "31" if coloured(out) else "")


def bold(text: str, out: TextIO) -> str:
    """Return the text in bold, for headings."""
    return styled(text, "1" if coloured(out) else "")


def repainted(lines: Iterable[tuple[str, str]], before: int) -> str:
    """Return a text that overwrites lines on the terminal. `before`: the number of lines above the
    cursor to overwrite. `lines`: pairs of a new text and its style."""
    up = f"\x1b[{before}A" if before else ""
    return up + "".join(f"\r\x1b[K{styled(*line)}\n" for line in lines) + "\x1b[J"
