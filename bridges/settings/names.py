"""Finds drivers and bus types: they are files, found by the names in a YAML.

Only names of existing files are imported. There is no table to edit, and no other file imports a driver
or a bus by its name.
"""

import importlib
from types import ModuleType

import drivers
import drivers.hal
from bridges.kinds import holding
from drivers.driver_type import AnyDriver
from drivers.hal import AnyBus


def driver_names(kind: str) -> list[str]:
    """What `driver:` may be: the files `drivers/<kind>/<driver>.py` that hold a `DRIVER`."""
    return holding(drivers.__path__, f"{kind}/*.py", "DRIVER", lambda path: path.stem)


def bus_types() -> list[str]:
    """What a bus's `type:` may be: the files and folders of `drivers/hal/` that hold a `BUS`."""
    files = holding(drivers.hal.__path__, "*.py", "BUS", lambda path: path.stem)
    folders = holding(drivers.hal.__path__, "*/__init__.py", "BUS", lambda path: path.parent.name)
    return sorted({*files, *folders})


def driver_called(kind: str, name: str) -> AnyDriver:
    """The driver that `kind:` and `driver:` name; one of `driver_names(kind)`."""
    driver: AnyDriver = driver_module(kind, name).DRIVER
    return driver


def driver_module(kind: str, name: str) -> ModuleType:
    """The file of a driver; one of `driver_names(kind)`."""
    return importlib.import_module(f"drivers.{kind}.{name}")


def bus_called(name: str) -> AnyBus:
    """The type of bus that `type:` names; one of `bus_types()`."""
    bus: AnyBus = importlib.import_module(f"drivers.hal.{name}").BUS
    return bus
