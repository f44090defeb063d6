"""A simulated lift (the plant) in virtual time, alone or behind the real driver on gpiozero's mock
pins."""

from pathlib import Path
from typing import Any

import msgspec

from bridges.kinds.lift.signals import LiftOutputs, LiftSample
from bridges.settings.load import load
from drivers.hal.gpio import GpioSettings as GpioSettings
from drivers.hal.gpio import canonical, open_bus
from drivers.lift.dry_contact import DryContactLiftSettings, create, wires
from hal_fakes.gpio import WiredFactory
from hal_fakes.plants.lift import LiftPace, LiftPlant
from hal_fakes.wiring import PlantWiring
from tests.drivers.lift.wirings import whole

SHIPPED = Path(__file__).parents[2] / "config" / "lift_dry_contact.yaml"
PACE = LiftPace(floor_s=2.0, door_s=1.0, agv_s=0.5, dwell_s=3.0)

Event = tuple[float, str, object]


def shipped() -> DryContactLiftSettings:
    """Return the settings of the lift in `config/lift_dry_contact.yaml`."""
    settings = load(SHIPPED).devices["Lift1"]
    assert isinstance(settings, DryContactLiftSettings)
    return settings


def lift(**changes: Any) -> LiftPlant:
    """Return a lift with three landings (B1, G, 1), wired as in `tests/drivers/lift/wirings.py`."""
    plant = LiftPlant("lift", msgspec.convert(whole(**changes), DryContactLiftSettings), PACE)
    plant.advance(0.0)
    return plant


def history(plant: LiftPlant, *without: str) -> list[Event]:
    """Return (s, signal, value) of every edge except the edges of the signals in `without`."""
    skipped = tuple(without)
    return [(round(e.at, 6), e.signal, e.value) for e in plant.edges if e.signal not in skipped]


class WiredLift:
    """The lift of `config/lift_dry_contact.yaml`, simulated down to its wires.

    The real driver reads and writes the wires through the project's GPIO bus on gpiozero's mock pins.
    """

    def __init__(self) -> None:
        self.now = 0.0
        settings = shipped()
        self.plant = LiftPlant("Lift1", settings, PACE)
        self.factory = WiredFactory(
            [PlantWiring(self.plant, wires(settings), canonical)], clock=lambda: self.now
        )
        self.bus = open_bus(GpioSettings(), self.factory)
        self.driver = create("Lift1", settings, self.bus)
        self.driver.open()

    def at(self, now: float) -> LiftSample:
        """Let the simulated lift run until the time `now`. Then read every input."""
        self.now = now
        self.factory.show(now)
        return self.driver.read()

    def write(self, **outputs: Any) -> None:
        self.driver.write(LiftOutputs(**outputs))

    def close(self) -> None:
        self.driver.close()
        self.bus.close()
