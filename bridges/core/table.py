"""A table that a person compares with a controller: `check` prints it, with boxes on its sheet."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Table:
    """Each row has as many cells as there are headings."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
