"""The depth of walks and the number of examples. A walk visits all states within some steps. Only `make
deep` runs everything."""

import os
from collections.abc import Sequence
from typing import Final, TypeVar

DEEP: Final = os.environ.get("DEEP") == "1"

T = TypeVar("T")


def depth(default: T, deep: T) -> T:
    """Return `default` in `make test` and `deep` in `make deep`. The number is the depth of a walk, or
    the fewest states that a walk must reach."""
    return deep if DEEP else default


def part(of: Sequence[T], one_in: int, first: int = 0) -> Sequence[T]:
    """Return all items in `make deep`. Otherwise return every `one_in`-th item, beginning at the index
    `first`."""
    return of if DEEP else of[first::one_in]


def examples(deep: int) -> int:
    """Return the number of examples that Hypothesis draws. `deep` is the number in `make deep`."""
    return deep if DEEP else max(deep // 4, 10)
