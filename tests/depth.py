"""How far walks go and how many examples are drawn: part of it by default, all of it in `make deep`."""

import os
from collections.abc import Sequence
from typing import Final, TypeVar

DEEP: Final = os.environ.get("DEEP") == "1"

T = TypeVar("T")


def depth(default: T, deep: T) -> T:
    """A depth of a walk, or how much it must find at least."""
    return deep if DEEP else default


def part(of: Sequence[T], one_in: int, first: int = 0) -> Sequence[T]:
    """One in so many of these by default, beginning with this one."""
    return of if DEEP else of[first::one_in]


def examples(deep: int) -> int:
    """How many examples Hypothesis draws."""
    return deep if DEEP else max(deep // 4, 10)
