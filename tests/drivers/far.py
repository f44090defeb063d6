"""The far side (simulated hardware) of every bus, in virtual time. These classes take the place of
`drivers/hal/`.

If `down` has a text, the bus raises HalError with this text, as the HAL does after its timeout. After
WATCHDOG_S the module behind that bus drops its outputs, like a module with a watchdog. The GPIO header
is never down, because it is not a bus.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

from drivers.hal import HalError, points
from drivers.hal.modbus.points import Point, RefusedRanges
from drivers.hal.points import Pull, Wire
from hal_fakes.http_charger import FakeHttpCharger
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.plant import Plant
from hal_fakes.wiring import PlantWiring

WATCHDOG_S = 2.0


class Clocked(Protocol):
    """An object with the virtual time of the test."""

    @property
    def now(self) -> float:
        """Return the virtual time (s)."""


class Cells(Protocol):
    """A station's registers (`hal_fakes.modbus.units`)."""

    outputs: frozenset[Point]

    def get(self, point: Point, now: float) -> int:
        """Return the value of a register or coil."""

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value, and return False if the point cannot be written."""


class PointsFar:
    """Contacts and relays on a header or at a module. The class replaces a
    `drivers.hal.points.PointsBus`."""

    def __init__(self, clock: Clocked, plant: Plant, wires: Iterable[Wire]) -> None:
        self.down = ""
        self._clock = clock
        self._wiring = PlantWiring(plant, wires, str)
        self._safe: dict[str, bool] = {}
        self._levels: dict[str, bool] = {}

    def canonical(self, point: str) -> str:
        return point

    def lines(
        self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool], *of_modbus: Any
    ) -> "points.Lines":
        self._safe = dict(outputs)
        return _Lines(self, dict(outputs))

    def watchdog(self) -> None:
        """Drop the outputs if the bus is down. The caller has waited WATCHDOG_S."""
        if self.down:
            self.drive(self._safe)

    def levels(self) -> dict[str, bool]:
        self.check()
        return self._wiring.levels(self._clock.now)

    def outputs(self) -> dict[str, bool]:
        self.check()
        return dict(self._levels)

    def drive(self, levels: Mapping[str, bool]) -> None:
        for point, level in levels.items():
            self._levels[point] = level
            self._wiring.drive(point, level, self._clock.now)

    def check(self) -> None:
        if self.down:
            raise HalError(self.down)


class _Lines:
    def __init__(self, far: PointsFar, safe: dict[str, bool]) -> None:
        self._far = far
        self._safe = safe

    def claim(self) -> None:
        self.write(self._safe)

    def read(self) -> Mapping[str, bool]:
        return self._far.levels()

    def write(self, levels: Mapping[str, bool]) -> None:
        self._far.check()
        self._far.drive(levels)

    def outputs(self) -> Mapping[str, int]:
        return self._far.outputs()

    def close(self) -> None:
        if not self._far.down:
            self._far.drive(self._safe)


class RegisterFar:
    """A controller's registers. The class replaces the part of `drivers.hal.modbus.ModbusBus` that
    drivers use."""

    def __init__(self, clock: Clocked, cells: Cells) -> None:
        self.down = ""
        self.scan_s = 0.1
        self.refused = RefusedRanges()
        self.now: Callable[[], float] = lambda: clock.now
        self._cells = cells
        self._first = {p: cells.get(p, 0.0) for p in cells.outputs}

    def guard(self, units: Iterable[int]) -> "RegisterFar":
        return self

    def check(self) -> None:
        """Do nothing, because this module has no watchdog that could trip."""

    def insist(self) -> None:
        """Do nothing, because this bus never pauses after a failure."""

    def watchdog(self) -> None:
        """Write the values that the controller had at the start, if the bus is down. The caller has
        waited WATCHDOG_S."""
        if self.down:
            for point, value in self._first.items():
                self._cells.set(point, value, self.now())

    def read(self, asked: Any, safe: bool = False) -> dict[Point, int]:
        self._answers()
        return {p: self._cells.get(p, self.now()) for p in asked.points()}

    def write(self, point: Point, value: int, safe: bool = False) -> None:
        self._answers()
        assert self._cells.set(point, int(value), self.now())

    def _answers(self) -> None:
        if self.down:
            raise HalError(self.down)


class HttpFar:
    """A charging station that answers HTTP. The class replaces `drivers.charger.http.Calls`."""

    def __init__(self, clock: Clocked, plant: ChargerPlant, settings: Any) -> None:
        self.down = ""
        self._clock = clock
        self._plant = plant
        self._station = FakeHttpCharger(plant, settings)

    def watchdog(self) -> None:
        """Do nothing, because this station has no timeout."""

    def get_json(self, path: str) -> dict[str, Any]:
        self._plant.advance(self._clock.now)
        reading = self._plant.reading()
        self._answers(reading.failures)
        found: dict[str, Any] = json.loads(self._station.body(reading))
        return found

    def send(
        self, path: str, method: str = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        self._answers(self._plant.failures)
        self._plant.drive("clear_error", True, self._clock.now)

    def _answers(self, failures: Mapping[str, Any]) -> None:
        """Raise HalError for every failure.

        The driver cannot distinguish a timeout, a refusal and nonsense.
        """
        server, body = failures.get("server"), failures.get("body")
        broken = server in ("off", "slow", "garbage") or "headers" in failures
        if self.down or broken or body in ("off", "stuck", "slow", "garbage"):
            raise HalError("the station does not answer")


Far = PointsFar | RegisterFar | HttpFar
