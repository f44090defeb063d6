"""A dispenser or ingestor behind a PLC's registers. The map's status number shows the plant's
contacts."""

from drivers.dispenser.register import RegisterWorkcellSettings, points
from drivers.hal.modbus.points import Point
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants import dispenser
from hal_fakes.plants.plant import Plant

NONSENSE = 65535
"""The status of a PLC that boots. It also stands for a fault that has no number in the map."""


def contacts(settings: RegisterWorkcellSettings) -> list[Wire]:
    """Return the PLC's own contacts and relay. The plant needs them, because they can fail in the same
    way as the daemon's wires."""
    at = points(settings)
    inputs = [Wire(s, "in", str(at["status"]), "high") for s in ("done", "busy", "ready", "fault")]
    return [*inputs, Wire("start", "out", str(at["command"]), "high")]


class FakeRegisterWorkcell:
    """The cells of one PLC, which are its registers and coils. `unit` is the PLC's Modbus unit.
    `points` are all cells, including `outputs`."""

    def __init__(self, plant: Plant, settings: RegisterWorkcellSettings) -> None:
        self.plant = plant
        self.unit = settings.unit
        self._map = settings.map
        found = points(settings)
        self._status, self._command = found.pop("status"), found["command"]
        self.points = frozenset({self._status, *found.values()})
        self.outputs = frozenset(found.values())
        self.written = dict.fromkeys(self.outputs, 0) | {self._command: self._map.command.rest}

    def get(self, point: Point, now: float) -> int:
        """Return this point's value at `now` (monotonic s)."""
        self.plant.advance(now)
        return self._state() if point == self._status else self.written[point]

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value. Return False if the point cannot be written."""
        if point not in self.outputs:
            return False
        self.written[point] = value
        if point == self._command:
            self.plant.drive("start", value == self._map.command.start, now)
        return True

    def _state(self) -> int:
        status, sense = self._map.status, self.plant.sense
        if sense("fault"):
            return next(iter(status.faults), NONSENSE)
        if sense("done"):
            return status.done[0]
        if sense("busy"):
            return status.busy[0]
        if sense("ready"):
            return status.ready[0]
        return next(iter(status.waits), NONSENSE)


FAKE = Fake[RegisterWorkcellSettings](
    plant=lambda name, settings, wires: dispenser.build(name, settings, contacts(settings)),
    station=lambda plant, settings: FakeRegisterWorkcell(plant, settings),
)
