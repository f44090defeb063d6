"""The wires between a plant's signals and a bus's points. Points have addresses and levels.

This is for buses with points (GPIO, Modbus). `plants/contact.py` describes how wires fail.
"""

from collections.abc import Callable, Iterable

from drivers.hal.points import Wire
from hal_fakes.plants.plant import Plant


class PlantWiring:
    """The wires between one plant and one bus. `canonical` returns the bus's spelling of a point.

    `clears_s` is the time (s) after which a module clears the coil of a call that the lift's controller
    has accepted. None means never.
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
        """Return the level (True is high) of every input at `now` (monotonic s), by its canonical
        point."""
        self.plant.advance(now)
        return {p: w.level(self.plant.sense(w.signal)) for p, w in self.inputs.items()}

    def drive(self, point: str, level: bool, now: float) -> None:
        """Set an output to this level of the bus at `now`. Raises KeyError if the output is not
        wired."""
        wire = self.outputs[point]
        self.plant.drive(wire.signal, wire.asserted(level), now)
