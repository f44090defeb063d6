"""A bus with the pins A0 to A9. Each pin has a second spelling: A0 is also 0A. A9 has no pull-up
resistor, and A8 can only be an input."""

import re
from collections.abc import Iterable

import msgspec

from drivers.hal import Bus, BusType
from drivers.hal.points import Wire


class Settings(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="type"
):
    """The settings of the pins."""

    chip: int | None = None


def canonical(point: str) -> str:
    """Return the canonical spelling of the point."""
    found = re.fullmatch(r"A(\d)|(\d)A", point)
    if not found:
        raise ValueError(f"{point!r} is not a pin: write A{point[:1] or 0}")
    return f"A{found[1] or found[2]}"


def describe(point: str) -> str:
    """Return both spellings of the point."""
    name = canonical(point)
    return f"{name} = {name[1]}A"


def wire_problems(wire: Wire) -> Iterable[str]:
    """Yield the reasons why the wire is impossible."""
    if wire.direction == "in" and wire.pull is None:
        yield "pull is missing"
    if wire.direction == "in" and wire.pull == "up" and "9" in wire.point:
        yield "A9 has no pull"
    if wire.direction == "out" and "8" in wire.point:
        yield "A8 cannot drive"


def open_bus(settings: Settings) -> Bus:
    """Open nothing: no test opens this bus."""
    raise NotImplementedError


BUS = BusType(
    settings=Settings,
    open_bus=open_bus,
    canonical=canonical,
    describe=describe,
    wire_problems=wire_problems,
)
