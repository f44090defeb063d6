"""The register map of a door operator, from a YAML or a profile: places and what the numbers mean."""

from collections.abc import Iterator
from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import Name
from drivers.hal.modbus.registers import REGISTERS, WRITABLE, Place, Word, misplaced

Bit = Annotated[int, msgspec.Meta(ge=0, le=15)]
Percent = Annotated[int, msgspec.Meta(ge=0, le=100)]
Problems = Iterator[tuple[tuple[str, ...], str]]


class Status(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Where the door is, as one number; an unlisted number is a fault.

    `at`: `input register N` or `holding register N`.
    `open`: the numbers of a fully open door.
    `closed`: the numbers of a closed door.
    `moving`: the numbers of a door that is between its end positions and has no fault.
    `faults`: number -> what is wrong.
    """

    at: Place
    open: Annotated[list[Word], msgspec.Meta(min_length=1)]
    closed: Annotated[list[Word], msgspec.Meta(min_length=1)]
    moving: Annotated[list[Word], msgspec.Meta(min_length=1)]
    faults: dict[Word, Name] = msgspec.field(default_factory=dict)

    def problems(self) -> Problems:
        """A place that is not a register; a number with two meanings."""
        yield from _place_problems(self.at, REGISTERS)
        first: dict[int, str] = {}
        for key in ("open", "closed", "moving", "faults"):
            for i, value in enumerate(getattr(self, key)):
                if value in first:
                    path = (key, str(value if key == "faults" else i))
                    yield path, f"{value} is listed under {first[value]} already"
                first.setdefault(value, key)


class Position(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How far the door is open, from 0 (closed) to 100 (open); any other number is a fault.

    `at`: `input register N` or `holding register N`.
    `unknown`: the number for an unknown position; then only the status counts.
    `open_from`: below this the door does not count as open, whatever the status.
    `closed_to`: above this the door does not count as closed, whatever the status.
    """

    at: Place
    unknown: Word | None = None
    open_from: Percent = 95
    closed_to: Percent = 5

    def problems(self) -> Problems:
        """A place that is not a register; thresholds that overlap; `unknown` within 0 to 100."""
        yield from _place_problems(self.at, REGISTERS)
        if self.unknown is not None and self.unknown <= 100:
            yield ("unknown",), "0 to 100 are positions"
        if self.open_from <= self.closed_to:
            yield ("open_from",), "must be greater than closed_to"


class Errors(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The faults that the operator reports. They are shown only; no decision depends on them.

    `at`: `input register N` or `holding register N`.
    `bits`: bit (0: least significant) -> fault; an unlisted bit is shown by its number.
    """

    at: Place
    bits: dict[Bit, Name] = msgspec.field(default_factory=dict)

    def problems(self) -> Problems:
        """A place that is not a register."""
        yield from _place_problems(self.at, REGISTERS)


class Flag(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One bit of a register.

    `at`: `input register N` or `holding register N`.
    `bit`: its number; 0 is the least significant.
    """

    at: Place
    bit: Bit

    def problems(self) -> Problems:
        """A place that is not a register."""
        yield from _place_problems(self.at, REGISTERS)


class Command(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The command that holds the door open. No value drives it shut.

    `at`: `coil N` or `holding register N`.
    `hold`: the value that holds it open.
    `release`: the value that releases it, so that the operator closes it by its own rules.
    `read_back`: false where the command can only be written; then it is written in every scan, and
    nothing proves that the operator took it.
    """

    at: Place
    hold: Word
    release: Word
    read_back: bool = True

    def problems(self) -> Problems:
        """A place that cannot be written; values that it cannot hold."""
        yield from _place_problems(self.at, WRITABLE)
        if self.hold == self.release:
            yield ("release",), "is the value of hold"
        if misplaced(self.at, ("coil",)) is None:
            for key in ("hold", "release"):
                if getattr(self, key) > 1:
                    yield (key,), "a coil is 0 or 1"


class Parts(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parts that replace those of the profile's map; each is given in full.

    `status`: where the door is, as one number.
    `position`: how far it is open.
    `errors`: the faults that it reports.
    `obstruction`: somebody is in the doorway; after CLOSE the hold lasts until the doorway is clear.
    `command`: what holds it open.
    """

    status: Status | None = None
    position: Position | None = None
    errors: Errors | None = None
    obstruction: Flag | None = None
    command: Command | None = None


class DoorMap(Parts, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An operator's register map. Addresses begin at 0."""

    status: Status
    command: Command

    def changed(self, parts: Parts | None) -> "DoorMap":
        """This map with `parts` in place of its own."""
        given = {name: getattr(parts, name, None) for name in Parts.__struct_fields__}
        return msgspec.structs.replace(self, **{n: p for n, p in given.items() if p is not None})

    def places(self) -> dict[str, str]:
        """Part -> its place, for each part that is given."""
        parts = {name: getattr(self, name) for name in Parts.__struct_fields__}
        return {name: part.at for name, part in parts.items() if part is not None}


def _place_problems(text: str, tables: tuple[str, ...]) -> Problems:
    if reason := misplaced(text, tables):
        yield ("at",), reason
