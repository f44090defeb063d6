"""The parts of a lift's register map: numbers in registers, and flags. Each part belongs to one Modbus
unit of the bus."""

from collections.abc import Collection
from typing import Annotated, Final, Literal, Protocol, TypeAlias

import msgspec

from bridges.kinds.lift.signals import Hazard
from bridges.kinds.shared.fields import Name, tells
from bridges.kinds.shared.remarks import Remarks
from drivers.hal.modbus.map_parts import InRegister, Placed
from drivers.hal.modbus.points import Point
from drivers.hal.modbus.registers import REGISTERS, Unit, Word, at
from drivers.lift.wiring import ServiceState
from drivers.numbers import Bit

UNIT: Final = tells("the unit of this place, if it is not the device's `unit`.")


class AtUnit(Protocol):
    """A field of the map that may name its own Modbus unit. Without such a unit, the field is at the
    device's unit."""

    @property
    def at(self) -> str:
        """Return the register, coil or discrete input, such as `coil 0`."""

    @property
    def unit(self) -> int | None:
        """Return the part's own unit. Return None if the part is at the device's unit."""


def place_of(part: AtUnit) -> str:
    """Return a part's place, such as `coil 0`. If the part has its own unit, return for example
    `unit 2 coil 0`."""
    return part.at if part.unit is None else f"unit {part.unit} {part.at}"


def point_at(unit: int, where: str) -> Point:
    """Return the point of a valid place that `place_of` has written. `unit` is the device's unit."""
    own, place = apart(where)
    return at(unit if own is None else own, place)


def apart(where: str) -> tuple[int | None, str]:
    """Split a text that `place_of` has written into the unit and the place, such as 2 and `coil 0`. The
    unit is None if the text names no unit. The place may be invalid."""
    if not where.startswith("unit "):
        return None, where
    _, own, place = where.split(" ", 2)
    return int(own), place


class NumberField(InRegister, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A number in a register."""

    bits: Annotated[
        list[Bit],
        tells("""the bits of the number, least significant first. Without `bits` the number is the
        whole register."""),
    ] = msgspec.field(default_factory=list)
    valid_when: Annotated[
        Literal["agv_mode"] | None,
        tells("`agv_mode` if the number is valid only while AGV mode is on."),
    ] = None
    unit: Annotated[Unit | None, UNIT] = None

    @property
    def mask(self) -> int:
        """The bits of the register that hold the number."""
        return self.word(0xFFFF)

    def number(self, word: int) -> int:
        """Extract the number from a register's value."""
        if not self.bits:
            return word
        return sum((word >> bit & 1) << i for i, bit in enumerate(self.bits))

    def word(self, number: int) -> int:
        """Return the register's value for a number."""
        if not self.bits:
            return number
        return sum((number >> i & 1) << bit for i, bit in enumerate(self.bits))

    def fits(self, numbers: Collection[int], key: str) -> Remarks:
        """Yield a problem for an invalid place, and for a bit that is listed twice. Yield a problem for
        each number that needs more bits than the YAML lists. `key` is the YAML key of the numbers."""
        yield from InRegister.problems(self)
        if len(set(self.bits)) < len(self.bits):
            yield ("bits",), "a bit is listed twice"
        for number in numbers:
            if self.bits and number >> len(self.bits):
                yield (key, str(number)), f"{number} does not fit on {len(self.bits)} bits"


class FloorField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The car's position."""

    codes: Annotated[dict[Word, Name], tells("number -> landing; an unlisted number is a fault.")]
    between_floors: Annotated[list[Word], tells("the numbers for a car between floors.")] = (
        msgspec.field(default_factory=list)
    )

    def problems(self) -> Remarks:
        """Yield the problems of `fits`, and a problem for each number with two meanings."""
        yield from self.fits([*self.codes, *self.between_floors], "codes")
        for number in self.codes:
            if number in self.between_floors:
                yield ("codes", str(number)), f"{number} means between floors as well"


class DoorField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A door."""

    codes: Annotated[
        dict[Word, Literal["open", "closed", "moving"]],
        tells("number -> state; an unlisted number is a fault."),
    ]

    def problems(self) -> Remarks:
        """Yield the problems of `fits`. Yield a problem if no code means open, or if no code means
        closed."""
        yield from self.fits(self.codes, "codes")
        if not {"open", "closed"} <= set(self.codes.values()):
            yield ("codes",), "needs a code for open and one for closed"


class MotionField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The car's motion."""

    codes: Annotated[
        dict[Word, Literal["stopped", "up", "down", "moving"]],
        tells("number -> motion; an unlisted number is a fault."),
    ]

    def problems(self) -> Remarks:
        """Yield the problems of `fits`. Yield a problem if no code means a standing car, or if no code
        means a moving car."""
        yield from self.fits(self.codes, "codes")
        shown = set(self.codes.values())
        if "stopped" not in shown or not ("moving" in shown or {"up", "down"} <= shown):
            yield (
                ("codes",),
                "needs a code for stopped, and also for moving, or for both up and down",
            )


class ServiceField(NumberField, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The lift's service state."""

    codes: Annotated[
        dict[Word, ServiceState],
        tells("number -> state; at an unlisted number the lift is out of service."),
    ]

    def problems(self) -> Remarks:
        """Yield the problems of `fits`."""
        yield from self.fits(self.codes, "codes")

    def means(self, number: int) -> str:
        """Return the state for a number."""
        state = self.codes.get(number, "fault")
        return Hazard.OUT_OF_SERVICE if state == "fault" else state


Number: TypeAlias = FloorField | DoorField | MotionField | ServiceField


class LiftFlag(Placed, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A flag, which is one bit."""

    bit: Annotated[Bit | None, tells("the bit's number; 0 is the least significant.")] = None
    active: Annotated[Literal["high", "low"], tells("the asserted level; `high` is 1.")]
    valid_when: Annotated[
        Literal["agv_mode"] | None,
        tells("`agv_mode` if the flag is valid only while AGV mode is on."),
    ] = None
    unit: Annotated[Unit | None, UNIT] = None

    @property
    def mask(self) -> int:
        """The flag's bit in its register."""
        return 1 << (self.bit or 0)

    def asserted(self, word: int) -> bool:
        """Return whether this value of the flag's register or bit means that the flag is asserted."""
        return bool(word >> (self.bit or 0) & 1) == (self.active == "high")

    def word(self, asserted: bool) -> int:
        """Return the value of the flag's register or bit that shows whether the flag is asserted."""
        return (asserted == (self.active == "high")) << (self.bit or 0)

    def problems(self) -> Remarks:
        """Yield a problem for an invalid place, for a register without a bit, and for a coil with a
        bit."""
        yield from super().problems()
        if self.is_in(*REGISTERS) and self.bit is None:
            yield ("bit",), "a flag is one bit of a register: give the bit"
        if self.is_in("coil", "discrete input") and self.bit is not None:
            yield ("bit",), "is for registers: a coil or discrete input is one bit already"
