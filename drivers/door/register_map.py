"""The register map of a door operator (the machine that moves the door), from a YAML or a profile. For
each part, such as the status, the map gives the place (Modbus table and address) and the meanings of
the numbers."""

from typing import Annotated

import msgspec

from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.modbus.map_parts import InRegister, RegisterBit, WrittenLevels
from drivers.hal.modbus.registers import Word
from drivers.numbers import Bit, listed_twice

Percent = Annotated[int, msgspec.Meta(ge=0, le=100)]


class Status(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The door's state as one number. A number that the map does not list counts as a fault."""

    open: Annotated[list[Word], msgspec.Meta(min_length=1), tells("numbers of a fully open door.")]
    closed: Annotated[list[Word], msgspec.Meta(min_length=1), tells("numbers of a closed door.")]
    moving: Annotated[
        list[Word],
        msgspec.Meta(min_length=1),
        tells("numbers of a door that is neither fully open nor closed, without a fault."),
    ]
    faults: Annotated[dict[Word, Name], tells("number -> fault.")] = msgspec.field(
        default_factory=dict
    )

    def problems(self) -> Remarks:
        """Yield a problem for a place that is not a register, and for a number with two meanings."""
        yield from super().problems()
        yield from listed_twice(
            {key: getattr(self, key) for key in ("open", "closed", "moving", "faults")}
        )


class DoorPosition(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The door's position, from 0 (closed) to 100 (open). Any other number counts as a fault."""

    unknown: Annotated[
        Word | None,
        tells("the number for an unknown position. With this number only the status counts."),
    ] = None
    open_from: Annotated[
        Percent,
        tells("below this position the door does not count as open, whatever the status says."),
    ] = 95
    closed_to: Annotated[
        Percent,
        tells("above this position the door does not count as closed, whatever the status says."),
    ] = 5

    def problems(self) -> Remarks:
        """Yield a problem for a place that is not a register. Yield a problem if `open_from` is not
        above `closed_to`, and if `unknown` is a number from 0 to 100."""
        yield from super().problems()
        if self.unknown is not None and self.unknown <= 100:
            yield ("unknown",), "0 to 100 are positions"
        if self.open_from <= self.closed_to:
            yield ("open_from",), "must be greater than closed_to"


class OperatorFaults(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The faults that the operator reports. The daemon only shows these faults. They do not change how
    the daemon commands the door."""

    bits: Annotated[
        dict[Bit, Name],
        tells("bit (0: least significant) -> fault. Other bits are shown by their number."),
    ] = msgspec.field(default_factory=dict)


class HoldCommand(WrittenLevels, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The command that holds the door open. No value of the command drives the door shut."""

    ON = "hold"
    OFF = "release"

    hold: Annotated[Word, tells("the value that holds the door open.")]
    release: Annotated[
        Word, tells("the value that releases the door, so that the operator closes it.")
    ]
    read_back: Annotated[
        bool,
        tells("""false if the command cannot be read back. In this case every scan writes the
        command, and nothing proves that the operator accepted it."""),
    ] = True


class Parts(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The parts of a register map that one door may change. A part given here replaces the same part of
    the profile's map completely."""

    status: Annotated[Status | None, tells("the door's state as one number.")] = None
    position: Annotated[DoorPosition | None, tells("the door's position.")] = None
    errors: Annotated[OperatorFaults | None, tells("the operator's faults.")] = None
    obstruction: Annotated[
        RegisterBit | None,
        tells("somebody is in the doorway. A held door stays held until the doorway is clear."),
    ] = None
    command: Annotated[HoldCommand | None, tells("the command that holds the door open.")] = None


class DoorMap(Parts, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """An operator's register map. Addresses begin at 0."""

    status: Annotated[Status, tells("the door's state as one number.")]
    command: Annotated[HoldCommand, tells("the command that holds the door open.")]

    def changed(self, parts: Parts | None) -> "DoorMap":
        """Return this map, with each part that `parts` gives in place of this map's own part."""
        given = {name: getattr(parts, name, None) for name in Parts.__struct_fields__}
        return msgspec.structs.replace(self, **{n: p for n, p in given.items() if p is not None})

    def places(self) -> dict[str, str]:
        """Return the place (Modbus table and address) of each part that the map gives."""
        parts = {name: getattr(self, name) for name in Parts.__struct_fields__}
        return {name: part.at for name, part in parts.items() if part is not None}
