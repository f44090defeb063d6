"""Serial ports of a Linux machine, by their paths."""

from pathlib import PurePath
from typing import Final

from drivers.hal import Needs

USB: Final = ("ttyUSB", "ttyACM")
BOARD: Final = ("ttyAMA", "ttyS")
MODULES: Final = {"ttyUSB": "usbserial", "ttyACM": "cdc_acm"}
"""Adapters on USB bring a class of device with their kernel module, which may come after the daemon."""


def needs(port: str) -> Needs:
    """What the daemon needs for the serial port of this path."""
    classes = _classes(PurePath(port))
    modules = tuple(MODULES[name] for name in classes if name in MODULES)
    return Needs(tuple(f"char-{name}" for name in classes), modules, "dialout")


def _classes(port: PurePath) -> tuple[str, ...]:
    """The classes of device (as in /proc/devices) that may stand behind it."""
    named = tuple(name for name in (*USB, *BOARD) if port.name.startswith(name))
    if named:
        return named
    if port.name.startswith("serial"):  # serial0 and serial1 of a Raspberry Pi
        return BOARD
    return ("pts",) if port.parent.name == "pts" else USB
