"""Colours, on a terminal only, and none where NO_COLOR is set (https://no-color.org)."""

import os
from typing import TextIO


def coloured(out: TextIO) -> bool:
    """Whether this output takes colours."""
    return out.isatty() and not os.environ.get("NO_COLOR")


def red(text: str, out: TextIO) -> str:
    """What needs attention."""
    return f"\x1b[31m{text}\x1b[0m" if coloured(out) else text


def bold(text: str, out: TextIO) -> str:
    """A heading."""
    return f"\x1b[1m{text}\x1b[0m" if coloured(out) else text
