"""The units behind pymodbus's servers. Their bits and registers have plants behind them, and can fail.

A gateway (`hal_fakes/modbus/__init__.py`) and a serial line (`hal_fakes/modbus/rtu.py`) share this
code.
"""

import asyncio
import time
from collections.abc import Iterable
from typing import Final, Literal, Protocol, TypeAlias

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException

from drivers.hal.modbus.points import Point, Range, Table, parse
from hal_fakes.modbus.dead_man import ModuleWatchdog
from hal_fakes.plants.plant import FailureMode, Plant
from hal_fakes.wiring import PlantWiring

Part = Literal["unit", "server"]


class UnitCells(Protocol):
    """Registers and bits of one unit, with a plant behind them. `outputs` are the cells that the daemon
    can write."""

    unit: int
    points: frozenset[Point]
    outputs: frozenset[Point]

    @property
    def plant(self) -> Plant | None:
        """Return the plant. Return None for registers that belong to the module itself."""

    def get(self, point: Point, now: float) -> int:
        """Return this point's value at `now` (monotonic s)."""

    def set(self, point: Point, value: int, now: float) -> bool:
        """Write a value. Return False if this point cannot be written."""


FarSide: TypeAlias = PlantWiring | UnitCells
"""A part of a unit: a plant's wires, or cells."""

TABLES: Final[dict[int, Table]] = {
    1: "coil",
    2: "discrete input",
    3: "holding register",
    4: "input register",
    5: "coil",
    6: "holding register",
    15: "coil",
    16: "holding register",
}
"""The table that each function number reads or writes."""


class FakeUnits:
    """All units, as pymodbus's server reads and writes them. `slow_s` is the delay (s) of a slow reply.

    Coils keep the written value. Inputs show the plants' contacts.
    """

    def __init__(self, devices: Iterable[FarSide], slow_s: float) -> None:
        self._slow_s = slow_s
        self._at: dict[Point, tuple[PlantWiring, str]] = {}
        self._bits: dict[Point, list[Point]] = {}
        self._cells: dict[Point, UnitCells] = {}
        self._dead_men: list[ModuleWatchdog] = []
        self._plants: dict[int | None, list[Plant]] = {None: []}
        self._coils: dict[Point, bool] = {}
        self._flashes: dict[Point, Point] = {}
        self._off_at: dict[Point, float] = {}
        self._clear_at: dict[Point, float] = {}
        self._before: dict[Point, int] = {}
        for device in devices:
            if isinstance(device, PlantWiring):
                self._add_wiring(device)
            else:
                self._add_cells(device)

    def _add_wiring(self, wiring: PlantWiring) -> None:
        points = {parse(name): name for name in (*wiring.inputs, *wiring.outputs)}
        self._at.update({point: (wiring, name) for point, name in points.items()})
        for point in points:
            if point.bit is not None:
                self._bits.setdefault(point.cell, []).append(point)
        self._flashes.update({parse(at): parse(name) for at, name in wiring.flashes.items()})
        for unit in (None, *{point.unit for point in points}):
            self._plants.setdefault(unit, []).append(wiring.plant)

    def _add_cells(self, device: UnitCells) -> None:
        self._cells.update(dict.fromkeys(device.points, device))
        units = {device.unit, *(point.unit for point in device.points)}
        self._plants.update({unit: self._plants.get(unit, []) for unit in units})
        if isinstance(device, ModuleWatchdog):
            self._dead_men.append(device)
        if device.plant:
            for unit in (None, *units):
                self._plants[unit].append(device.plant)

    def tick(self) -> None:
        """Let watchdogs trip, and end pulses, when their time has come. The server calls this often."""
        now = time.monotonic()
        for coil in [coil for coil, at in self._off_at.items() if at <= now]:
            self._set(coil, False)
        for coil in [coil for coil, at in self._clear_at.items() if at <= now]:
            del self._clear_at[coil]
            self._coils[coil] = False  # only the coil goes off; the lift's call stays
        for dead_man in self._dead_men:
            if dead_man.trips(now):
                for point, (wiring, name) in self._at.items():
                    if point.unit == dead_man.unit and self._coils.pop(point, False):
                        wiring.drive(name, False, now)

    def failure(self, part: Part, unit: int | None = None) -> FailureMode | None:
        """Return the failure of the server, or of this unit. Return None if the part works."""
        modes = (plant.failures.get(part) for plant in self._plants.get(unit, ()))
        return next((mode for mode in modes if mode is not None), None)

    def has(self, unit: int) -> bool:
        """Does this unit exist?"""
        return unit in self._plants

    async def async_getValues(
        self, device_id: int, func_code: int, address: int, count: int = 1
    ) -> list[int] | ExcCodes:
        """Return the bits or registers for a read request, or for a write's echo."""
        points = await self._points(device_id, func_code, address, count)
        if isinstance(points, ExcCodes):
            return points
        return [self._value(point) for point in points]

    async def async_setValues(
        self, device_id: int, func_code: int, address: int, values: list[int]
    ) -> ExcCodes | None:
        """Write to coils or registers."""
        points = await self._points(device_id, func_code, address, len(values))
        if isinstance(points, ExcCodes):
            return points
        for point, value in zip(points, values, strict=True):
            if refusal := self._set(point, value):
                return refusal
        return None

    async def flash(self, unit: int, address: int, tenths: int) -> ExcCodes | None:
        """Switch a coil on for this time (in 0.1 s). Return exception 3 if the coil cannot make a
        pulse."""
        coil = self._flashes.get(Point(unit, "coil", address))
        points = await self._points(unit, 5, coil.address if coil else address, 1)
        if isinstance(points, ExcCodes):
            return points
        if coil is None:
            return ExcCodes.ILLEGAL_VALUE
        if refusal := self._set(coil, True):
            return refusal
        self._off_at[coil] = time.monotonic() + tenths / 10
        return None

    def _set(self, point: Point, value: int) -> ExcCodes | None:
        now = time.monotonic()
        if point in self._cells:
            taken = self._cells[point].set(point, int(value), now)
            return None if taken else ExcCodes.ILLEGAL_VALUE
        if point in self._bits:
            return ExcCodes.ILLEGAL_VALUE
        if any(d.unit == point.unit and d.tripped for d in self._dead_men):
            return ExcCodes.DEVICE_FAILURE
        wiring, name = self._at[point]
        self._off_at.pop(point, None)
        self._coils[point] = bool(value)
        if name in wiring.outputs:
            wiring.drive(name, bool(value), now)
            if value and wiring.clears_s is not None and wiring.outputs[name].clearing:
                self._clear_at[point] = now + wiring.clears_s
        return None

    async def _points(
        self, unit: int, function: int, address: int, count: int
    ) -> list[Point] | ExcCodes:
        """Return a request's points, or its exception code. Raise NoSuchIdException for a unit that
        stays silent."""
        table = TABLES.get(function)
        if table is None:
            return ExcCodes.ILLEGAL_FUNCTION
        failures = (self.failure("server"), self.failure("unit", unit))
        if failures[0] == "stuck" or failures[1] == "off":
            raise NoSuchIdException("silent")
        if "slow" in failures:
            await asyncio.sleep(self._slow_s)
        if failures[1] == "wrong":
            return ExcCodes.DEVICE_FAILURE
        points = Range(unit, table, address, count).points()
        if unit not in self._plants:
            return ExcCodes.GATEWAY_NO_RESPONSE
        known = self._at.keys() | self._cells.keys() | self._bits.keys()
        if not known.issuperset(points):
            return ExcCodes.ILLEGAL_ADDRESS
        return points

    def _value(self, point: Point) -> int:
        if point in self._at and self._at[point][1] in self._at[point][0].outputs:
            return self._coils.get(point, False)
        if point in self._cells and point in self._cells[point].outputs:
            return self._now_at(point)
        if self.failure("unit", point.unit) != "stuck":
            self._before[point] = self._now_at(point)
        return self._before.get(point, 0)

    def _now_at(self, point: Point) -> int:
        now = time.monotonic()
        if point in self._cells:
            return self._cells[point].get(point, now)
        if point in self._bits:
            return sum(self._now_at(bit) << (bit.bit or 0) for bit in self._bits[point])
        wiring, name = self._at[point]
        return wiring.levels(now)[name]
