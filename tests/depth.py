"""The depth of walks and the number of examples: a part by default, everything in `make deep`."""

import os
from collections.abc import Sequence
from typing import Final, TypeVar

DEEP: Final = os.environ.get("DEEP") == "1"

T = TypeVar("T")


def depth(default: T, deep: T) -> T:
    """Return `default` in `make test` and `deep` in `make deep`: a walk's depth, or how much a walk
    must find.
    """
    return deep if DEEP else default


def part(of: Sequence[T], one_in: int, first: int = 0) -> Sequence[T]:
    """Return, in `make test`, every `one_in`-th item from number `first` on; in `make deep`, all
    items.
    """
    return of if DEEP else of[first::one_in]


def examples(deep: int) -> int:
    """Return how many examples Hypothesis draws."""
    return deep if DEEP else max(deep // 4, 10)
