"""Fakes are found like drivers: `DRIVER` and `BUS` name a module, and its `FAKE` stands in for them.

Only this file imports fakes by name. A driver that names none gets the plant of its kind,
`hal_fakes/plants/<kind>.py`, at the far end of its wires.
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
    """One sort of controller.

    `plant(name, settings, wires)`: its physics; `wires` is the driver's table.
    `station(plant, settings)`: what the bus's fake puts on the bus, with that plant behind it. Without
    it, the plant's contacts are put there as a `PlantWiring`.
    """

    plant: Callable[[str, Settings, Sequence[Wire]], Plant]
    station: Callable[[Plant, Settings], object] | None = None


class Server(Protocol):
    """A running far side.

    `replace`: what to write into the bus's settings instead
    (`{"tcp": {"host": "127.0.0.1", "port": 41234}}`).
    """

    replace: dict[str, object]

    def close(self) -> None:
        """Stop serving. Does not raise."""


@dataclass(frozen=True)
class Outside(Generic[Settings, Station]):
    """The far side of a bus, in a process of its own.

    `serve(settings, stations)`: starts a real server on 127.0.0.1, or on its own line, and returns at
    once. It may call the plants from any thread, and does not keep their time.
    """

    serve: Callable[[Settings, Sequence[Station]], Server]


@dataclass(frozen=True)
class Inside(Generic[Settings, Station]):
    """The far side of a bus that cannot leave the daemon's process.

    `open_bus(settings, stations, world)`: makes the real bus with these stations on it.
    """

    open_bus: Callable[[Settings, Sequence[Station], RealTime], Bus]


FarSide: TypeAlias = Inside[Any, Any] | Outside[Any, Any]


def plants_on(config: Config, bus: str) -> dict[str, Plant]:
    """A new plant for each device on this bus."""
    return {
        name: _fake(config, name).plant(name, config.devices[name], config.wires(name))
        for name in config.devices_on(bus)
    }


def stations_on(config: Config, bus: str, plants: Mapping[str, Plant]) -> list[Any]:
    """What stands on this bus, with the devices' plants behind it."""
    return [_station(config, bus, name, plants[name]) for name in config.devices_on(bus)]


def _station(config: Config, bus: str, name: str, plant: Plant) -> object:
    station = _fake(config, name).station
    if station is None:
        return PlantWiring(plant, config.wires(name), config.bus_type(bus).canonical)
    return station(plant, config.devices[name])


def far_side(config: Config, bus: str) -> FarSide:
    """The far side of this bus. Raises HalError where its type has none."""
    name = config.bus_type(bus).fake
    if not name:
        raise HalError(f"a bus of type {config.bus_types[bus]} cannot be simulated: it has no fake")
    found: FarSide = import_module(name).FAKE
    return found


def _fake(config: Config, device: str) -> Fake[Any]:
    name = config.driver_type(device).fake or f"hal_fakes.plants.{config.kind}"
    found: Fake[Any] = import_module(name).FAKE
    return found
