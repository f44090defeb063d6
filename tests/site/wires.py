"""The far side of every bus, in virtual time: what the drivers talk to instead of `drivers/hal/`.

A bus that is down raises HalError, as the HAL does after its timeout. The module behind it drops its
outputs after WATCHDOG_S, as those with a watchdog do; the GPIO header has no bus to lose.
"""

import json
from collections.abc import Iterable, Mapping
from typing import Any

from drivers.hal import HalError, points
from drivers.hal.modbus.points import Point
from drivers.hal.points import Pull, Wire
from hal_fakes.http_charger import HttpCharger
from hal_fakes.modbus.register_door import RegisterDoor
from hal_fakes.plants.charger import ChargerPlant
from hal_fakes.plants.machine import Machine
from hal_fakes.wiring import Wiring
from tests.site.timeline import Timeline

WATCHDOG_S = 2.0


class PointsFar:
    """Contacts and relays on a header or at a module (`drivers.hal.points.PointsBus`)."""

    def __init__(self, timeline: Timeline, plant: Machine, wires: Iterable[Wire]) -> None:
        self.down = False
        self._timeline = timeline
        self._wiring = Wiring(plant, wires, str)
        self._safe: dict[str, bool] = {}

    def canonical(self, point: str) -> str:
        return point

    def lines(
        self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool]
    ) -> "points.Lines":
        self._safe = dict(outputs)
        return _Lines(self, dict(outputs))

    def watchdog(self) -> None:
        """The module has not been spoken to for too long."""
        if self.down:
            self.drive(self._safe)

    def levels(self) -> dict[str, bool]:
        self.check()
        return self._wiring.levels(self._timeline.now)

    def drive(self, levels: Mapping[str, bool]) -> None:
        for point, level in levels.items():
            self._wiring.drive(point, level, self._timeline.now)

    def check(self) -> None:
        if self.down:
            raise HalError("the module does not answer")


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

    def outputs(self) -> None:
        return None

    def close(self) -> None:
        if not self._far.down:
            self._far.drive(self._safe)


class RegisterFar:
    """A door operator's registers (the part of `drivers.hal.modbus.ModbusBus` that its driver uses)."""

    def __init__(self, timeline: Timeline, door: RegisterDoor) -> None:
        self.down = False
        self._timeline = timeline
        self.now = lambda: timeline.now
        self._door = door
        self._first = {p: door.get(p, 0.0) for p in door.outputs}

    def guard(self, units: Iterable[int]) -> "RegisterFar":
        return self

    def check(self) -> None:
        """For a module's watchdog: it has not tripped."""

    def insist(self) -> None:
        """There is no pause to break off."""

    def watchdog(self) -> None:
        """The operator has not been spoken to for too long."""
        if self.down:
            for point, value in self._first.items():
                self._door.set(point, value, self._timeline.now)

    def read(self, asked: Any, safe: bool = False) -> dict[Point, int]:
        self._answers()
        return {p: self._door.get(p, self._timeline.now) for p in asked.points()}

    def write(self, point: Point, value: int, safe: bool = False) -> None:
        self._answers()
        self._door.set(point, int(value), self._timeline.now)

    def _answers(self) -> None:
        if self.down:
            raise HalError("the operator does not answer")


class HttpFar:
    """A charging station's HTTP (`drivers.charger.http.Calls`)."""

    def __init__(self, timeline: Timeline, plant: ChargerPlant, settings: Any) -> None:
        self.down = False
        self._timeline = timeline
        self._plant = plant
        self._station = HttpCharger(plant, settings)

    def watchdog(self) -> None:
        """For a station's own timeout, which this one does not have."""

    def get_json(self, path: str) -> dict[str, Any]:
        self._plant.advance(self._timeline.now)
        reading = self._plant.reading()
        self._answers(reading.failures)
        found: dict[str, Any] = json.loads(self._station.body(reading))
        return found

    def send(
        self, path: str, method: str = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        self._answers(self._plant.failures)
        self._plant.drive("clear_error", True, self._timeline.now)

    def _answers(self, failures: Mapping[str, Any]) -> None:
        """All that ends in a deadline, a refusal or nonsense is the same to the driver."""
        server, body = failures.get("server"), failures.get("body")
        broken = server in ("off", "slow", "garbage") or "headers" in failures
        if self.down or broken or body in ("off", "stuck", "slow", "garbage"):
            raise HalError("the station does not answer")


Far = PointsFar | RegisterFar | HttpFar
