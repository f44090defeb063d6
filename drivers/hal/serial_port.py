"""Serial ports of a Linux machine, by their paths."""

from pathlib import PurePath
from typing import Final

from drivers.hal import Needs

USB: Final = ("ttyUSB", "ttyACM")
BOARD: Final = ("ttyAMA", "ttyS")
MODULES: Final = {"ttyUSB": "usbserial", "ttyACM": "cdc_acm"}
"""The kernel module for each class of USB adapters. /proc/devices lists the class only while its module
is loaded. The kernel may load the module after the daemon's start, when somebody plugs an adapter
in."""


def needs(port: str) -> Needs:
    """Return the permissions that the daemon needs for the serial port at this path."""
    classes = _classes(PurePath(port))
    modules = tuple(MODULES[name] for name in classes if name in MODULES)
    return Needs(tuple(f"char-{name}" for name in classes), modules, "dialout")


def _classes(port: PurePath) -> tuple[str, ...]:
    """Return the device classes (as in /proc/devices) that may be behind a port."""
    named = tuple(name for name in (*USB, *BOARD) if port.name.startswith(name))
    if named:
        return named
    if port.name.startswith("serial"):  # serial0 and serial1 of a Raspberry Pi
        return BOARD
    return ("pts",) if port.parent.name == "pts" else USB
