"""How far walks go and how many examples are drawn: part of it by default, all of it in `make deep`."""

import os
from collections.abc import Sequence
from typing import Final, TypeVar

DEEP: Final = os.environ.get("DEEP") == "1"

T = TypeVar("T")


def depth(default: T, deep: T) -> T:
    """The first in `make test`, the second in `make deep`: a walk's depth, or how much it must find."""
    return deep if DEEP else default


def part(of: Sequence[T], one_in: int, first: int = 0) -> Sequence[T]:
    """In `make test` one in `one_in` of these, from number `first` on; in `make deep` all of them."""
    return of if DEEP else of[first::one_in]


def examples(deep: int) -> int:
    """How many examples Hypothesis draws."""
    return deep if DEEP else max(deep // 4, 10)
