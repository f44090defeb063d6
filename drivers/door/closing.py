"""The row about closing that `check` prints for every door driver."""

from typing import Final

CLOSING: Final = (
    "closing",
    "not commanded: a released door stays open unless its door operator closes it by itself",
)
"""A row for `check`, as (subject, meaning)."""
