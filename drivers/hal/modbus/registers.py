"""The spelling of a place in register maps and profiles: `holding register 4`, `coil 0`.

A place has no unit, because one map serves several units. Addresses begin at 0, as in the frames on the
wire. The numbers of the data model begin at 1. For example, 40001 is holding register 0, and 30001 is
input register 0. Such a number is refused, and the error names the right address.
"""

import re
from collections.abc import Collection
from typing import Annotated, Final

import msgspec

from drivers.hal.modbus.points import Point, Table, address

Word = Annotated[int, msgspec.Meta(ge=0, le=65535)]
"""A register's content."""
Unit = Annotated[int, msgspec.Meta(ge=0, le=255)]
Place = Annotated[
    str,
    msgspec.Meta(
        min_length=1,
        max_length=40,
        extra={"number": "table and address; addresses begin at 0 (input register 1)"},
    ),
]
"""A place, such as `holding register 4`, `input register 0x10`, `coil 0` or `discrete input 2`."""

TABLES: Final[dict[str, Table]] = {
    "coil": "coil",
    "discrete input": "discrete input",
    "holding register": "holding register",
    "input register": "input register",
}
REGISTERS: Final = ("holding register", "input register")
WRITABLE: Final = ("coil", "holding register")

_SPELLING: Final = re.compile(r"(?P<table>[a-z][a-z _-]*?)[\s_]+(?P<address>0x[0-9a-f]+|[0-9]+)")


def place(text: str, tables: Collection[str] = tuple(TABLES)) -> tuple[Table, int]:
    """Return (table, address) of a place. Raises ValueError with the right spelling."""
    how = " or ".join(f"'{table} 0'" for table in tables)
    words = _SPELLING.fullmatch(text.strip().lower())
    table = TABLES.get(re.sub(r"[\s_-]+", " ", words["table"])) if words else None
    if words is None or table is None or table not in tables:
        raise ValueError(f"{text!r}: write {how}; addresses begin at 0")
    return table, address(table, words["address"])


def misplaced(text: str, tables: Collection[str]) -> str | None:
    """Return the error of a misspelt place, for a struct's `problems`. Return None for a valid
    place."""
    try:
        place(text, tables)
    except ValueError as error:
        return str(error)
    return None


def at(unit: int, text: str, base: int = 0) -> Point:
    """Return the point of this unit that a valid place names. Add `base` to the address of the
    place."""
    table, address = place(text)
    return Point(unit, table, address + base)
