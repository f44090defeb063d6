"""What `check` says of closing, whatever a door is reached by."""

from typing import Final

CLOSING: Final = (
    "closing",
    "nothing is driven: a released door stays open unless its operator closes it by itself",
)
"""A row for `check`."""
