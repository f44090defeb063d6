"""The longest texts that are accepted from the graph. Anybody can send them, and they are stored."""

from typing import Final

from bridges.core.decision import RequestRefused

LONGEST_NAME: Final = 256
LONGEST_TEXT: Final = 10_000
"""The longest error_message of a ChargerState."""


def check_length(longest: int = LONGEST_NAME, /, **fields: str) -> None:
    """Raise RequestRefused for the first of these fields (name=text) that is too long."""
    for field, text in fields.items():
        if len(text) > longest:
            raise RequestRefused(f"impossible {field}", f"{text[:40]!r}…, {len(text)} characters")
