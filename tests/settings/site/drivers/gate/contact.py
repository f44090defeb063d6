"""A driver with wires. Its structs have a field of each type that a struct may have."""

from enum import Enum
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.kinds.shared.fields import DeviceSettings, Name, Seconds
from bridges.kinds.shared.remarks import Remarks
from drivers import Driver
from drivers.driver_type import DriverType
from drivers.hal.points import Input, Output, Wire

Code = Annotated[int, Meta(ge=0, le=15)]


class Side(Enum):
    """A choice of two sides."""

    LEFT = "left"
    RIGHT = "right"


class Lane(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A lane. Both of its fields have default values."""

    side: Side = Side.LEFT
    heights: tuple[Annotated[float, Meta(gt=0, lt=5, extra={"unit": "m"})], ...] = ()


class Limits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits with each type of number."""

    open_s: Annotated[float, Meta(ge=0.1, le=60, extra={"unit": "s"})] = 5.0
    close_s: Seconds | None = None
    tries: Annotated[int, Meta(ge=1)] = 3
    even: Annotated[int, Meta(multiple_of=2)] = 2
    gain: float = 1.0
    loud: bool = False
    baud: Literal[9600, 19200] = 9600
    label: Annotated[str, Meta(pattern="^[a-z]+$", extra={"pattern": "a small word"})] | int = 0

    def problems(self) -> Remarks:
        """Yield conflicts between several fields."""
        if self.close_s is not None and self.close_s > self.open_s:
            yield ("close_s",), "'close_s' may not be longer than 'open_s'"


class Settings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of a gate on contacts."""

    lanes: list[Name] | dict[Name, Lane]
    inputs: dict[Name, Input]
    outputs: dict[Name, Output] = msgspec.field(default_factory=dict)
    bits: Annotated[list[Input], Meta(max_length=2)] = msgspec.field(default_factory=list)
    codes: dict[Code, Name] = msgspec.field(default_factory=dict)
    limits: Limits = Limits()

    def problems(self) -> Remarks:
        """Yield a problem for each code that names an unknown lane."""
        for code, lane in self.codes.items():
            if lane not in self.lanes:
                yield ("codes", str(code)), f"code {code} is no lane: '{lane}'"


def wires(settings: Settings) -> list[Wire]:
    """Return the wiring table."""
    return [
        *(_input(name, i, ("inputs", name)) for name, i in settings.inputs.items()),
        *(_input(f"bit_{n}", i, ("bits", str(n))) for n, i in enumerate(settings.bits)),
        *(
            Wire(name, "out", o.point, o.active, path=("outputs", name))
            for name, o in settings.outputs.items()
        ),
    ]


def _input(name: str, i: Input, path: tuple[str, ...]) -> Wire:
    return Wire(name, "in", i.point, i.active, i.pull, i.debounce_s, path)


def warnings(settings: Settings) -> Remarks:
    """Yield settings that are legal but unusual."""
    if settings.limits.loud:
        yield ("limits", "loud"), "it will be loud"


def create(name: str, settings: Settings, bus: object) -> Driver[None, None]:
    """Create nothing: no test runs this driver."""
    raise NotImplementedError


DRIVER = DriverType(
    settings=Settings, buses=("pins", "module"), create=create, wires=wires, warnings=warnings
)
