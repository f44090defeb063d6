"""The whole lift without its pins: node, driver, wires and plant, in virtual time."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import msgspec

from bridges.lift.signals import LiftOutputs, LiftSample
from bridges.settings.load import load
from drivers.hal.modbus import ModbusBus
from drivers.hal.modbus.dead_man import Guard, Watchdogs
from drivers.hal.modbus.points import Point, Range
from drivers.hal.points import Pull
from drivers.lift import register
from drivers.lift.dry_contact import Settings, create, debounce, wires
from hal_fakes.modbus import register_lift
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.plants.plant import FailureMode
from hal_fakes.wiring import Wiring
from tests.lift.story import Building, Story

SHIPPED = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"


def shipped() -> Settings:
    """The shipped example of `config/`."""
    settings = load(SHIPPED).devices["Lift1"]
    assert isinstance(settings, Settings)
    return settings


class WiredBuilding(Building):
    """The plant at the far ends of the wires; it is also the bus (`drivers.hal.points.PointsBus`)."""

    def __init__(self, settings: Settings) -> None:
        super().__init__()
        self.plant = LiftPlant("Lift1", settings)
        self._wiring = Wiring(self.plant, wires(settings), str)
        self._driver = create("Lift1", settings, self)

    def canonical(self, point: str) -> str:
        return point

    def lines(self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool]) -> "_Lines":
        return _Lines(self, outputs)

    def open(self) -> None:
        self._driver.open()

    def read(self) -> LiftSample:
        super().read()
        return self._driver.read()

    def write(self, outputs: LiftOutputs) -> None:
        super().write(outputs)
        self._driver.write(outputs)

    @property
    def standing_open_at(self) -> str | None:
        """The landing where the car really stands with its door really open."""
        car, (door,) = self.plant.car, self.plant.doors.values()
        return f"L{car.floor + 1}" if car.standing and door.opened else None


class _Lines:
    """Levels straight from the plant and to it (`drivers.hal.points.Lines`)."""

    def __init__(self, building: WiredBuilding, safe: Mapping[str, bool]) -> None:
        self._building, self._safe = building, safe

    def claim(self) -> None:
        self.write(self._safe)

    def read(self) -> dict[str, bool]:
        return self._building._wiring.levels(self._building.now)

    def write(self, levels: Mapping[str, bool]) -> None:
        for point, level in levels.items():
            self._building._wiring.drive(point, level, self._building.now)

    def outputs(self) -> None:
        return None

    def close(self) -> None:
        self.write(self._safe)


class GatewayBuilding(Building):
    """The plant behind a gateway's registers; it is also the bus (`drivers.hal.modbus.lines.Units`)."""

    def __init__(self, settings: register.Settings) -> None:
        super().__init__()
        self.plant = register_lift.build("Lift1", settings)
        self._cells = register_lift.RegisterLift(self.plant, settings)
        self._driver = register.create("Lift1", settings, cast(ModbusBus, _Registers(self)))

    def open(self) -> None:
        self._driver.open()

    def read(self) -> LiftSample:
        super().read()
        return self._driver.read()

    def write(self, outputs: LiftOutputs) -> None:
        super().write(outputs)
        self._driver.write(outputs)


class _Registers:
    """The gateway's registers, at once and without a wire."""

    def __init__(self, building: GatewayBuilding) -> None:
        self._building = building
        self.now = lambda: building.now
        self._watchdogs = Watchdogs(cast(ModbusBus, self), None, lambda: building.now)

    def read(self, asked: Range, safe: bool = False) -> dict[Point, int]:
        cells, now = self._building._cells, self._building.now
        return {point: cells.get(point, now) for point in asked.points()}

    def write(self, point: Point, value: int, safe: bool = False) -> None:
        assert self._building._cells.set(point, value, self._building.now)

    def guard(self, units: Iterable[int]) -> Guard:
        return self._watchdogs.guard(units)

    def insist(self) -> None:
        """There is no pause to break off."""


class WiredStory(Story):
    """A lift in service; the shipped one if it is not said which."""

    building: WiredBuilding

    def __init__(self, settings: Settings | None = None, **limits: Any) -> None:
        settings = settings or shipped()
        super().__init__(
            WiredBuilding(settings),
            floors=settings.floors,
            debounce=dict(debounce(settings)),
            agv_mode=settings.agv_mode,
            **{**msgspec.structs.asdict(settings.limits), **limits},
        )

    def fail(self, part: str, mode: FailureMode | None) -> None:
        """A wire or part breaks (None: is mended)."""
        self.building.plant.advance(self.now)
        self.building.plant.fail(part, mode)

    def press(self, what: str, asserted: bool) -> None:
        """Somebody in the building does something."""
        self.building.plant.press(what, asserted, self.now)
