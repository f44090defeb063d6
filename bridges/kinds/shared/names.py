"""Checks of names and texts in messages from the graph. The checks limit the lengths, because the
daemon stores these texts and anybody can send them."""

from collections.abc import Collection
from typing import Final

from bridges.kinds.shared.decision import RequestRefused
from bridges.messages.words import LONGEST_NAME

LONGEST_TEXT: Final = 10_000
"""The greatest length of a ChargerState's error_message (characters)."""


def check_length(longest: int = LONGEST_NAME, /, **fields: str) -> None:
    """Raise RequestRefused for the first of these fields (name=text) that is too long."""
    for field, text in fields.items():
        if len(text) > longest:
            raise RequestRefused(f"impossible {field}", f"{text[:40]!r}…, {len(text)} characters")


def check_listed(what: str, name: str, listed: Collection[str] | None) -> None:
    """Raise RequestRefused for a name that is empty, too long or not listed in the YAML.

    `what`: `lift` or `door`. `listed`: the names in the YAML's list; None if the YAML has no list, so
    that every name is accepted.
    """
    if not name:
        raise RequestRefused(f"empty {what}_name", f"a {what} needs a name")
    check_length(**{f"{what}_name": name})
    if listed is not None and name not in listed:
        raise RequestRefused("not ours", f"{name!r} is not one of {', '.join(listed)}")
