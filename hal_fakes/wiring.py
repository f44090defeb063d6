"""The wires between a plant's signals and a bus's points (with addresses and levels).

For buses with points (GPIO, Modbus). `plants/contact.py` describes how wires fail.
"""

from collections.abc import Callable, Iterable

from drivers.hal.points import Wire
from hal_fakes.plants.plant import Plant


class PlantWiring:
    """The wires between one plant and one bus. `canonical` is the bus's spelling of a point.

    `clears_s`: how soon a module clears the coil of a call that its controller has taken; None: never.
    """

    def __init__(
        self,
        plant: Plant,
        wires: Iterable[Wire],
        canonical: Callable[[str], str],
        clears_s: float | None = None,
    ) -> None:
        self.plant = plant
        self.clears_s = clears_s
        wires = list(wires)
        self.inputs = {canonical(w.point): w for w in wires if w.direction == "in"}
        self.outputs = {canonical(w.point): w for w in wires if w.direction == "out"}
        self.flashes = {canonical(w.flash.point): canonical(w.point) for w in wires if w.flash}

    def levels(self, now: float) -> dict[str, bool]:
        """Return every input's level (True is high) by canonical point, at `now` (monotonic s)."""
        self.plant.advance(now)
        return {p: w.level(self.plant.sense(w.signal)) for p, w in self.inputs.items()}

    def drive(self, point: str, level: bool, now: float) -> None:
        """Set an output to the bus's level at `now`. Raises KeyError if it is not wired."""
        wire = self.outputs[point]
        self.plant.drive(wire.signal, wire.asserted(level), now)
