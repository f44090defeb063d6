"""The row of `check` about closing, which is the same for every door driver."""

from typing import Final

CLOSING: Final = (
    "closing",
    "nothing is driven: a released door stays open unless its operator closes it by itself",
)
"""A row for `check`, as (subject, meaning)."""
