"""Modbus: the coils, discrete inputs and registers of units, over TCP or on a serial line (RTU).

    settings.py       the bus in the YAML
    tcp_or_serial.py  the address or the serial line in the YAML
    watchdog.py       the modules' watchdog in the YAML
    points.py         the spelling of contacts and relays
    registers.py      the spelling of places in a register map
    bus.py            the units of one connection or line, with retries and pauses
    lines.py          the coils and registers of one device: reads and writes them, and verifies
                      each write; if a second master writes an output too, reports this as a fault
    clearing.py       commands that a controller takes and clears by itself, such as lift calls
    dead_man.py       arms and refreshes the modules' watchdogs
    wire.py           a request and its answer
    tcp.py, rtu.py    carry requests and answers
    frames.py         makes and reads the frames

Only frames.py (pymodbus) and rtu.py (pyserial) import a library. They are themselves imported only when
a bus needs them.
"""

from drivers.hal import BusType
from drivers.hal.modbus.bus import ModbusBus
from drivers.hal.modbus.points import canonical, describe, wire_problems, wire_warnings
from drivers.hal.modbus.settings import (
    ModbusSettings,
    claims,
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
    claims=claims,
)
