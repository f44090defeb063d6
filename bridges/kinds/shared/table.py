"""A table of settings, which a person compares with the settings of a lift or door controller. `check`
prints the table. The printed sheet has boxes to tick."""

from msgspec import Struct


class Table(Struct, frozen=True):
    """A table. Each row has as many cells as there are headings."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def filled(self) -> "Table":
        """Return the table without empty columns."""
        kept = [i for i in range(len(self.headings)) if any(row[i] for row in self.rows)]
        headings, *rows = (tuple(row[i] for i in kept) for row in (self.headings, *self.rows))
        return Table(self.title, headings, tuple(rows))
