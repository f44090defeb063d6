"""The row about closing that `check` prints for every door driver."""

from typing import Final

CLOSING: Final = (
    "closing",
    "nothing is driven: a released door stays open unless its operator closes it by itself",
)
"""A row for `check`: (subject, meaning)."""
