"""CAN through python-can: one bus, on an interface of the kernel (SocketCAN) or on an slcan adapter.

    settings.py    the settings in a YAML
    frames.py      frames, their ids and their names
    bus.py         receives and distributes frames, pauses, and notes troubles such as bus-off
    link.py        opens, reads and sends through python-can
    broadcasts.py  one device that broadcasts its frames and needs periodic frames from the driver
    canopen.py     one CANopen node
    sdo.py         the SDO client of the canopen library

Only link.py and sdo.py import a library. They are themselves imported only when the daemon makes a bus
or a node.
"""

from drivers.hal import BusType
from drivers.hal.can.bus import CanBus
from drivers.hal.can.frames import EXTENDED, Frame, FrameFilter, named
from drivers.hal.can.settings import CanSettings, Slcan, describe, needs, warnings, where

__all__ = [
    "BUS",
    "EXTENDED",
    "CanBus",
    "CanSettings",
    "Frame",
    "FrameFilter",
    "Slcan",
    "describe",
    "named",
    "warnings",
]


BUS = BusType(
    settings=CanSettings,
    open_bus=CanBus,
    fake="hal_fakes.can",
    where=where,
    needs=needs,
    warnings=warnings,
)
