"""Modbus: the coils, discrete inputs and registers of units, over TCP or on a serial line (RTU).

    settings.py   settings of the YAML; also tcp_or_serial.py (address or line) and watchdog.py
    points.py     spelling of contacts and relays; registers.py: spelling of a map's places
    bus.py        the units of one connection or line: retries, pauses
    lines.py      one device's coils and registers: claim, read, write, read back, release; a second
                  master on one output is a fault, and makes no relay chatter
    clearing.py   calls that the controller takes and clears by itself
    dead_man.py   arms and refreshes the modules' watchdogs
    wire.py       a request and its answer; tcp.py and rtu.py carry them, frames.py makes the frames

Only frames.py (pymodbus) and rtu.py (pyserial) import a library. They are imported when a bus needs it.
"""

from drivers.hal import BusType
from drivers.hal.modbus.bus import ModbusBus
from drivers.hal.modbus.points import canonical, describe, wire_problems, wire_warnings
from drivers.hal.modbus.settings import (
    ModbusSettings,
    needs,
    paced,
    tables,
    unreachable,
    unwatched,
    warnings,
    where,
)
from drivers.hal.modbus.tcp_or_serial import Serial, Tcp

__all__ = [
    "BUS",
    "ModbusBus",
    "ModbusSettings",
    "Serial",
    "Tcp",
    "canonical",
    "describe",
    "warnings",
    "wire_problems",
]


BUS = BusType(
    settings=ModbusSettings,
    open_bus=ModbusBus,
    fake="hal_fakes.modbus",
    where=where,
    needs=needs,
    warnings=warnings,
    canonical=canonical,
    describe=describe,
    wire_problems=wire_problems,
    wire_warnings=wire_warnings,
    unreachable=unreachable,
    unwatched=unwatched,
    paced=paced,
    tables=tables,
)
