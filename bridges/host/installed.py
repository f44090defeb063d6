"""What people look with may not be installed: no daemon needs it, and nothing of `bridges` imports
it."""

import importlib
import importlib.util
from types import ModuleType

HOW = "sudo apt install rmf-bridges, or pip install from a clone of the repository"


class NotInstalled(Exception):
    """The workbench is not on this machine. The text says what to install."""


def of_workbench(name: str) -> ModuleType:
    """A module of the workbench, found by its name below it. Raises NotInstalled."""
    if importlib.util.find_spec("workbench") is None:
        raise NotInstalled(f"this needs the workbench, which is not installed: {HOW}")
    return importlib.import_module(f"workbench.{name}")
