"""A door driver in one file. An output releases the latch, and one contact shows that the door is
shut."""

from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import DoorOutputs, DoorSample
from drivers.driver_type import DriverType
from drivers.hal.points import Input, Output, Points, PointsBus, Wire


class Settings(DoorSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The points of the latch and its contact."""

    latch: Output
    shut: Input


def wires(settings: Settings) -> list[Wire]:
    """Return the wiring table."""
    shut, latch = settings.shut, settings.latch
    return [
        Wire("closed", "in", shut.point, shut.active, shut.pull, 0.05, ("shut",)),
        Wire("hold_open", "out", latch.point, latch.active, path=("latch",)),
    ]


class Door:
    """A driver of one door (`drivers.Driver[DoorSample, DoorOutputs]`)."""

    def __init__(self, points: Points) -> None:
        self._points = points
        self.open, self.make_safe, self.close = points.open, points.make_safe, points.close

    def read(self) -> DoorSample:
        """Read every input."""
        return DoorSample(closed=self._points.read()["closed"])

    def write(self, outputs: DoorOutputs) -> None:
        """Switch the latch."""
        self._points.write({"hold_open": outputs.hold_open})


def create(name: str, settings: Settings, bus: PointsBus) -> Door:
    """Return the driver of one door on this bus."""
    return Door(Points(wires(settings), bus))


DRIVER = DriverType(settings=Settings, buses=("gpio", "modbus"), create=create, wires=wires)
