"""The real buses that a YAML names."""

import importlib
from collections.abc import Callable
from typing import Any

from drivers.hal import Bus

OpenBus = Callable[[str, Any], Bus]


def open_bus(name: str, settings: Any) -> Bus:
    """The real bus that the YAML names."""
    hal = importlib.import_module(type(settings).__module__)
    bus: Bus = hal.open_bus(settings)
    return bus
