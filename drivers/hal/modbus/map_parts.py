"""The parts of a register map in a YAML or a profile, such as a place, a bit or a command.

The register maps of lifts, doors, chargers and module watchdogs consist of these parts.
"""

from collections.abc import Collection, Mapping
from typing import Annotated, ClassVar

import msgspec

from bridges.kinds.shared.fields import tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.modbus.registers import REGISTERS, TABLES, WRITABLE, Place, Word, misplaced
from drivers.numbers import Bit


class Placed(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A part of a register map that has a place (Modbus table and address). `TABLES` lists the tables
    that the place may be in."""

    TABLES: ClassVar[Collection[str]] = tuple(TABLES)
    refused: ClassVar[Mapping[str, str]] = {
        "bus": "all places of a map are on the device's own bus: only contacts (driver: dry_contact)"
        " can be on another bus"
    }

    at: Annotated[
        Place, tells("`input register N`, `holding register N`, `coil N` or `discrete input N`.")
    ]

    def problems(self) -> Remarks:
        """Yield a problem for an invalid place."""
        if reason := misplaced(self.at, self.TABLES):
            yield ("at",), reason

    def is_in(self, *tables: str) -> bool:
        """Return whether the part's place is in one of these tables."""
        return misplaced(self.at, tables) is None


class InRegister(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A part that the driver reads from a register."""

    TABLES: ClassVar[Collection[str]] = REGISTERS

    at: Annotated[Place, tells("`input register N` or `holding register N`.")]


class WrittenPlace(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A part that the driver writes."""

    TABLES: ClassVar[Collection[str]] = WRITABLE

    at: Annotated[Place, tells("`coil N` or `holding register N`.")]


class RegisterBit(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One bit of a register."""

    bit: Annotated[Bit, tells("the bit's number; 0 is the least significant.")]

    def is_on(self, word: int) -> bool:
        """Return whether the bit is set in a register's value."""
        return bool(word >> self.bit & 1)


class WrittenLevels(WrittenPlace, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A command with an on value and an off value. `ON` and `OFF` are the names of the two keys in the
    map."""

    ON: ClassVar[str]
    OFF: ClassVar[str]

    def value(self, on: bool) -> int:
        """Return the value to write for on or off."""
        value: Word = getattr(self, self.ON if on else self.OFF)
        return value

    def problems(self) -> Remarks:
        """Yield a problem for a place that cannot be written, for equal values, and for values that do
        not fit the place."""
        yield from super().problems()
        if self.value(True) == self.value(False):
            yield (self.OFF,), f"is the value of {self.ON} too"
        for key in (self.ON, self.OFF):
            if getattr(self, key) > 1 and self.is_in("coil"):
                yield (key,), "a coil is 0 or 1"
