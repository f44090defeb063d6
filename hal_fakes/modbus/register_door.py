"""A door operator behind Modbus registers. The numbers of its register map show the plant's contacts.

The operator knows only its end positions, 0 and 100. Between the ends its position is the number for
`unknown`, or 50.
"""

from drivers.door.register import RegisterDoorSettings, door_map, points
from drivers.door.register_map import DoorMap, Status
from drivers.hal.modbus.points import Point
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants import door
from hal_fakes.plants.plant import Plant

NONSENSE = 65535
"""The status of a door that is open and closed at once."""


def contacts(settings: RegisterDoorSettings) -> list[Wire]:
    """Return the operator's own contacts and relay. The plant needs them, because they can fail in the
    same way as the daemon's wires."""
    at = points(settings)
    signals = {"opened": "status", "closed": "status", "obstruction": "obstruction"}
    inputs = [Wire(s, "in", str(at[part]), "high") for s, part in signals.items() if part in at]
    return [*inputs, Wire("hold_open", "out", str(at["command"]), "high")]


class FakeRegisterDoor:
    """The cells of one operator, which are its registers and coils. `unit` is the operator's Modbus
    unit. `points` are all cells, including `outputs`."""

    def __init__(self, plant: Plant, settings: RegisterDoorSettings) -> None:
        self.plant = plant
        self.unit = settings.unit
        self._map: DoorMap = door_map(settings)
        self._parts = points(settings)
        self._command = self._map.command.release
        self.points = frozenset(self._parts.values())
        self.outputs = frozenset({self._parts["command"]})

    def get(self, point: Point, now: float) -> int:
        """Return this point's value at `now` (monotonic s)."""
        self.plant.advance(now)
        value = 0
        for part, where in self._parts.items():
            if where == point:
                value |= self._value(part)
        return value

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value. Return False if the point cannot be written."""
        if point != self._parts["command"]:
            return False
        self._command = value
        if value in (self._map.command.hold, self._map.command.release):
            self.plant.drive("hold_open", value == self._map.command.hold, now)
        return True

    def _value(self, part: str) -> int:
        if part == "command":
            return self._command
        if part == "status":
            return self._status(self._map.status)
        if part == "position" and self._map.position:
            between = self._map.position.unknown or 50
            return self._at_limit(100, 0, between)
        if part == "obstruction" and self._map.obstruction:
            return int(self.plant.sense("obstruction")) << self._map.obstruction.bit
        return 0

    def _status(self, status: Status) -> int:
        if self.plant.sense("opened") and self.plant.sense("closed"):
            return NONSENSE
        return self._at_limit(status.open[0], status.closed[0], status.moving[0])

    def _at_limit(self, opened: int, closed: int, between: int) -> int:
        if self.plant.sense("opened"):
            return opened
        return closed if self.plant.sense("closed") else between


FAKE = Fake[RegisterDoorSettings](
    plant=lambda name, settings, wires: door.build(name, settings, contacts(settings)),
    station=lambda plant, settings: FakeRegisterDoor(plant, settings),
)
