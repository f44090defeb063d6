"""What the names in a YAML stand for: kinds, drivers and bus types are files, found by name.

Only the name of a file that exists is ever imported. There is no table of them to edit.
"""

import importlib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import bridges
import drivers
import drivers.hal
from bridges.core.graph_kind import AnyKind


def kind_names() -> list[str]:
    """What `kind:` may be: the folders of `bridges/` that hold a `KIND`."""
    return _found(bridges, "*/__init__.py", "KIND", lambda path: path.parent.name)


def driver_names(kind: str) -> list[str]:
    """What `driver:` may be: the files `drivers/<kind>/<driver>.py` that name their buses."""
    return _found(drivers, f"{kind}/*.py", "BUSES", lambda path: path.stem)


def bus_types() -> list[str]:
    """What a bus's `type:` may be: the files and folders of `drivers/hal/` that open one."""
    files = _found(drivers.hal, "*.py", "def open_bus(", lambda path: path.stem)
    folders = _found(drivers.hal, "*/__init__.py", "def open_bus(", lambda path: path.parent.name)
    return sorted({*files, *folders})


def _found(package: ModuleType, pattern: str, line: str, name: Callable[[Path], str]) -> list[str]:
    """Names of the files that have a line which begins so.

    They are searched, not imported: others beside them need a vendor's library.
    """
    found = (path for root in package.__path__ for path in Path(root).glob(pattern))
    return sorted({name(path) for path in found if f"\n{line}" in path.read_text("utf-8")})


def kind_called(name: str) -> AnyKind:
    """The kind that `kind:` names; one of `kind_names()`."""
    kind: AnyKind = importlib.import_module(f"bridges.{name}").KIND
    return kind


def driver_called(kind: str, name: str) -> ModuleType:
    """The driver that `kind:` and `driver:` name; one of `driver_names(kind)`."""
    return importlib.import_module(f"drivers.{kind}.{name}")


def bus_called(name: str) -> ModuleType:
    """The file of a bus that `type:` names; one of `bus_types()`."""
    return importlib.import_module(f"drivers.hal.{name}")
