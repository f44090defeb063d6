"""Colours, on a terminal only, and none where NO_COLOR is set (https://no-color.org); lines that are
drawn in place."""

import os
from collections.abc import Iterable
from typing import TextIO


def coloured(out: TextIO) -> bool:
    """Whether this output takes colours."""
    return out.isatty() and not os.environ.get("NO_COLOR")


def styled(text: str, style: str) -> str:
    """The text in a style: the numbers of ECMA-48's SGR (`1;31`), or "" for a plain one."""
    return f"\x1b[{style}m{text}\x1b[0m" if style else text


def red(text: str, out: TextIO) -> str:
    """What needs attention."""
    return styled(text, "31" if coloured(out) else "")


def bold(text: str, out: TextIO) -> str:
    """A heading."""
    return styled(text, "1" if coloured(out) else "")


def repainted(lines: Iterable[tuple[str, str]], before: int) -> str:
    """The text that draws lines (text, style) over the `before` lines above the cursor."""
    up = f"\x1b[{before}A" if before else ""
    return up + "".join(f"\r\x1b[K{styled(*line)}\n" for line in lines) + "\x1b[J"
