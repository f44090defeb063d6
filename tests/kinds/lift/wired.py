"""A simulated lift (the plant) in virtual time: the node, the driver, and wires or registers without
hardware."""

from pathlib import Path
from typing import Any, cast

import msgspec

from bridges.kinds.lift.signals import LiftOutputs, LiftSample
from bridges.settings.load import load
from drivers import Driver
from drivers.hal.modbus import ModbusBus
from drivers.lift import register
from drivers.lift.dry_contact import DryContactLiftSettings, create, debounce, wires
from hal_fakes.modbus import register_lift
from hal_fakes.plants.lift import LiftPlant
from hal_fakes.plants.plant import FailureMode
from tests.drivers.far import PointsFar, RegisterFar
from tests.kinds.lift.story import Building, Story

SHIPPED = Path(__file__).parents[3] / "config" / "lift_dry_contact.yaml"


def shipped() -> DryContactLiftSettings:
    """Return the settings of the lift in `config/lift_dry_contact.yaml`."""
    settings = load(SHIPPED).devices["Lift1"]
    assert isinstance(settings, DryContactLiftSettings)
    return settings


class Driven(Building):
    """A building that is read and written by a real driver, with a simulated lift (the plant) behind
    it."""

    plant: LiftPlant
    _driver: Driver[LiftSample, LiftOutputs]

    def open(self) -> None:
        self._driver.open()

    def read(self) -> LiftSample:
        super().read()
        return self._driver.read()

    def write(self, outputs: LiftOutputs) -> None:
        super().write(outputs)
        self._driver.write(outputs)


class WiredBuilding(Driven):
    """A building whose simulated lift has a wire for each signal."""

    def __init__(self, settings: DryContactLiftSettings) -> None:
        super().__init__()
        self.plant = LiftPlant("Lift1", settings)
        self._driver = create("Lift1", settings, PointsFar(self, self.plant, wires(settings)))

    @property
    def standing_open_at(self) -> str | None:
        """Return the landing at which the car really stands with an open door."""
        car, (door,) = self.plant.car, self.plant.doors.values()
        return f"L{car.floor + 1}" if car.standing and door.opened else None


class GatewayBuilding(Driven):
    """A building whose simulated lift is behind the registers of a gateway."""

    def __init__(self, settings: register.RegisterLiftSettings) -> None:
        super().__init__()
        self.plant = register_lift.build("Lift1", settings)
        bus = RegisterFar(self, register_lift.FakeRegisterLift(self.plant, settings))
        self._driver = register.create("Lift1", settings, cast(ModbusBus, bus))


class WiredStory(Story):
    """A lift with wires, in service. By default it is the lift of `config/lift_dry_contact.yaml`."""

    building: WiredBuilding

    def __init__(self, settings: DryContactLiftSettings | None = None, **limits: Any) -> None:
        settings = settings or shipped()
        super().__init__(
            WiredBuilding(settings),
            floors=settings.floors,
            debounce=dict(debounce(settings)),
            agv_mode=settings.agv_mode,
            **{**msgspec.structs.asdict(settings.limits), **limits},
        )

    def fail(self, part: str, mode: FailureMode | None) -> None:
        """Let a wire or part fail in this mode, or repair it (None)."""
        self.building.plant.advance(self.now)
        self.building.plant.fail(part, mode)

    def press(self, what: str, asserted: bool) -> None:
        """Let somebody in the building switch a signal on (`asserted`) or off."""
        self.building.plant.press(what, asserted, self.now)
