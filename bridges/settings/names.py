"""Finds drivers and bus types by their names in a YAML. Each name is the name of a file.

Drivers and bus types are found by looking for files, so no table lists them. No other module imports a
driver or a bus by its name.
"""

import importlib
from types import ModuleType

import drivers
import drivers.hal
from bridges.kinds import holding
from drivers.driver_type import AnyDriver
from drivers.hal import AnyBus


def driver_names(kind: str) -> list[str]:
    """List the values of `driver:`. They are the names of the files `drivers/<kind>/<driver>.py` that
    define a `DRIVER`."""
    return holding(drivers.__path__, f"{kind}/*.py", "DRIVER", lambda path: path.stem)


def bus_types() -> list[str]:
    """List the values of a bus's `type:`. They are the names of the files and folders in `drivers/hal/`
    that define a `BUS`."""
    files = holding(drivers.hal.__path__, "*.py", "BUS", lambda path: path.stem)
    folders = holding(drivers.hal.__path__, "*/__init__.py", "BUS", lambda path: path.parent.name)
    return sorted({*files, *folders})


def driver_called(kind: str, name: str) -> AnyDriver:
    """Import the driver `name` of this kind. `name` must be in `driver_names(kind)`."""
    driver: AnyDriver = driver_module(kind, name).DRIVER
    return driver


def driver_module(kind: str, name: str) -> ModuleType:
    """Import the file of a driver. `name` must be in `driver_names(kind)`."""
    return importlib.import_module(f"drivers.{kind}.{name}")


def bus_called(name: str) -> AnyBus:
    """Import the bus type `name`. `name` must be in `bus_types()`."""
    bus: AnyBus = importlib.import_module(f"drivers.hal.{name}").BUS
    return bus
