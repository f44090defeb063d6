"""A simulated Modbus module in virtual time. The rules for read-back, contradictions and pauses are the
real rules of the HAL (`drivers/hal`).

The module has no connection, so timeouts and backoff (`drivers/hal/modbus/bus.py`) are missing.
"""

from collections.abc import Mapping
from typing import Any

from drivers.hal.modbus.lines import ModbusLines
from drivers.hal.modbus.points import Point, parse
from drivers.hal.points import Pull
from hal_fakes.wiring import PlantWiring
from tests.drivers.far import PointsFar, RegisterFar


class ModuleFar(PointsFar):
    """A simulated device behind a Modbus module. Coils in `dead` stay off, whatever the daemon
    writes."""

    dead: frozenset[Point] = frozenset()

    def lines(
        self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool], *of_modbus: Any
    ) -> ModbusLines:
        units = RegisterFar(self._clock, _Cells(self, self._wiring))
        self.units = units
        found = {name: parse(name) for name in inputs}, {name: parse(name) for name in outputs}
        return ModbusLines(units, *found, dict(outputs), *of_modbus)  # type: ignore[arg-type]

    def silent(self, why: str) -> None:
        """Stop answering, and give this reason. With "" answer again."""
        self.down = self.units.down = why


class _Cells:
    def __init__(self, far: ModuleFar, wiring: PlantWiring) -> None:
        self._far = far
        self._wiring = wiring
        self._coils: dict[Point, int] = {}
        self._names = {parse(name): name for name in (*wiring.inputs, *wiring.outputs)}
        self.outputs = frozenset(parse(name) for name in wiring.outputs)

    def get(self, point: Point, now: float) -> int:
        name = self._names.get(point, "")
        if name in self._wiring.inputs:
            return self._wiring.levels(now)[name]
        return self._coils.get(point, 0)

    def set(self, point: Point, value: int, now: float) -> bool:
        self._coils[point] = 0 if point in self._far.dead else value
        self._wiring.drive(self._names[point], bool(self._coils[point]), now)
        return True
