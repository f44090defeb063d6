"""Finds the fake of a driver or a bus by the name of a module. The driver's `DRIVER` and the bus's
`BUS` name this module. `FAKE` of this module replaces the hardware.

Only this file imports fakes by name. If a driver has no fake, the wires of its device lead to the
kind's plant, `hal_fakes/plants/<kind>.py`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

from bridges.settings.load import Config
from drivers.hal import Bus, HalError
from drivers.hal.points import Wire
from hal_fakes.plants.plant import Plant
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring

Settings = TypeVar("Settings")
Station = TypeVar("Station")


@dataclass(frozen=True)
class Fake(Generic[Settings]):
    """A fake controller of one sort.

    - `plant(name, settings, wires)` makes the physics of the device. `wires` is the driver's wiring
      table.
    - `station(plant, settings)` makes the controller that the bus's fake serves. The plant is behind
      the controller. If `station` is None, a `PlantWiring` connects the plant's contacts to the bus.
    - `sited(config, name)` makes a plant that needs more of the YAML than the device's settings. If
      given, `sited` replaces `plant`.
    """

    plant: Callable[[str, Settings, Sequence[Wire]], Plant]
    station: Callable[[Plant, Settings], object] | None = None
    sited: Callable[[Config, str], Plant] | None = None


class Server(Protocol):
    """The running far side of a bus, which is the simulated hardware behind the bus.

    `replace` has the settings with which the real bus finds the far side, for example
    `{"tcp": {"host": "127.0.0.1", "port": 41234}}`.
    """

    replace: dict[str, object]

    def close(self) -> None:
        """Stop serving. Does not raise."""


@dataclass(frozen=True)
class Outside(Generic[Settings, Station]):
    """The far side of a bus, in a process of its own.

    - `serve(settings, stations)` starts a real server on 127.0.0.1, or on a simulated serial line, and
      returns at once. The server may call the plants from any thread. The server need not advance the
      plants' time, because a `RealTime` does so.
    - `parts` are the parts of the far side that can fail, for each plant on the bus.
    """

    serve: Callable[[Settings, Sequence[Station]], Server]
    parts: Sequence[str] = ()


@dataclass(frozen=True)
class Inside(Generic[Settings, Station]):
    """The far side of a bus that must be in the daemon's process.

    `open_bus(settings, stations, world)` makes the real bus with these stations on it. `world` runs the
    plants in real time.
    """

    open_bus: Callable[[Settings, Sequence[Station], RealTime], Bus]


FarSide: TypeAlias = Inside[Any, Any] | Outside[Any, Any]


def plants_on(config: Config, bus: str) -> dict[str, Plant]:
    """Make a plant for each device on this bus."""
    far = far_side(config, bus)
    plants = {name: _plant(config, name) for name in config.devices_on(bus)}
    for plant in plants.values():
        plant.add_parts(far.parts if isinstance(far, Outside) else ())
    return plants


def _plant(config: Config, name: str) -> Plant:
    fake = _fake(config, name)
    if fake.sited is not None:
        return fake.sited(config, name)
    return fake.plant(name, config.devices[name], config.wires(name))


def stations_on(config: Config, bus: str, plants: Mapping[str, Plant]) -> list[Any]:
    """Return this bus's stations. There is one for each device on the bus, and one for each device of
    another bus that has contacts here."""
    return [_station(config, bus, name, plants[name]) for name in config.devices_at(bus)]


def _station(config: Config, bus: str, name: str, plant: Plant) -> object:
    station = _fake(config, name).station
    if station is None:
        return PlantWiring(plant, config.wires_on(bus, name), config.bus_type(bus).canonical)
    return station(plant, config.devices[name])


def far_side(config: Config, bus: str) -> FarSide:
    """Return the far side of this bus. Raises HalError if the bus's type has no fake."""
    name = config.bus_type(bus).fake
    if not name:
        raise HalError(
            f"a bus of type {config.bus_types[bus]} cannot be simulated, because this type has no fake"
        )
    found: FarSide = import_module(name).FAKE
    return found


def _fake(config: Config, device: str) -> Fake[Any]:
    name = config.driver_type(device).fake or f"hal_fakes.plants.{config.kind}"
    found: Fake[Any] = import_module(name).FAKE
    return found
