"""Finds kinds, drivers and bus types: they are files, found by the names in a YAML.

Only names of existing files are imported. There is no table to edit, and no other file imports a kind,
a driver or a bus by its name.
"""

import importlib
import pkgutil
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import bridges.kinds
import drivers
import drivers.hal
from drivers.driver_type import AnyDriver
from drivers.hal import AnyBus

if TYPE_CHECKING:
    from bridges.kinds.shared.graph_kind import AnyKind
    from bridges.kinds.shared.recorded import Recorded


def kind_names() -> list[str]:
    """What `kind:` may be: the folders of `bridges/kinds/` that hold a `KIND`."""
    return _found(bridges.kinds, "*/__init__.py", "KIND", lambda path: path.parent.name)


def driver_names(kind: str) -> list[str]:
    """What `driver:` may be: the files `drivers/<kind>/<driver>.py` that hold a `DRIVER`."""
    return _found(drivers, f"{kind}/*.py", "DRIVER", lambda path: path.stem)


def bus_types() -> list[str]:
    """What a bus's `type:` may be: the files and folders of `drivers/hal/` that hold a `BUS`."""
    files = _found(drivers.hal, "*.py", "BUS", lambda path: path.stem)
    folders = _found(drivers.hal, "*/__init__.py", "BUS", lambda path: path.parent.name)
    return sorted({*files, *folders})


def _found(
    package: ModuleType, pattern: str, record: str, name: Callable[[Path], str]
) -> list[str]:
    """Names of the files that hold such a record."""
    return sorted({name(path) for path in _holding(tuple(package.__path__), pattern, record)})


@cache
def _holding(roots: tuple[str, ...], pattern: str, record: str) -> list[Path]:
    """The files that hold such a record. They are read, once, and not imported: some need a vendor's
    library."""
    found = (path for root in roots for path in Path(root).glob(pattern))
    holds = re.compile(rf"^{record}(:| =)", re.MULTILINE).search
    return [path for path in found if holds(path.read_text("utf-8"))]


def kind_called(name: str) -> "AnyKind":
    """The kind that `kind:` names; one of `kind_names()`."""
    kind: AnyKind = _package(name).KIND
    return kind


def recorded(kind: str) -> "Recorded":
    """The names of a kind's values in recordings; none if its values are those of another kind."""
    found: Recorded = getattr(_package(kind), "RECORDED", {})
    return found


def kind_files(name: str) -> Iterator[ModuleType]:
    """Every file of a kind. Raises ImportError if one cannot be imported."""
    package = _package(name)
    for file in pkgutil.iter_modules(package.__path__, f"{package.__name__}."):
        yield importlib.import_module(file.name)


def _package(kind: str) -> ModuleType:
    return importlib.import_module(f"bridges.kinds.{kind}")


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
