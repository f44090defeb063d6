"""How far walks go and how many examples are drawn: part of it by default, all of it in `make deep`."""

import os
from typing import Final, TypeVar

DEEP: Final = os.environ.get("DEEP") == "1"

T = TypeVar("T")


def depth(default: T, deep: T) -> T:
    """A depth of a walk, or how much it must find at least."""
    return deep if DEEP else default


def examples(deep: int) -> int:
    """How many examples Hypothesis draws."""
    return deep if DEEP else max(deep // 4, 10)
