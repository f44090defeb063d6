"""The far side of a `modbus` bus: a real pymodbus TCP server on 127.0.0.1, as a gateway with units.

Each device's points are bits of its units, with the plant behind them; an address that nobody has
answers exception 2, a unit that nobody has exception 11, as a gateway does. On command (`fail DEVICE
unit|server MODE`) one unit, or the server with all of them, is

- `off`: the unit is silent; the server refuses and drops connections
- `stuck`: the unit's inputs stay as they were; the server takes requests and never answers
- `slow`: the reply comes after the client has stopped waiting
- `garbage`: bytes that are no Modbus
- `wrong`: the unit answers exception 4, the server with another transaction's number
"""

import asyncio
import random
import threading
import time
from collections.abc import Coroutine, Iterable, Mapping
from typing import Any, Final, Literal

from pymodbus.constants import ExcCodes
from pymodbus.exceptions import NoSuchIdException
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from drivers.hal.modbus_points import Point, Range, Table, canonical, parse
from hal_fakes.plant import FailureMode, Plant
from hal_fakes.wiring import Wiring, wirings

Part = Literal["unit", "server"]

LOOK_S: Final = 0.02
"""How soon a server that is told to be off is off."""
READY_S: Final = 10.0
TABLES: Final[dict[int, Table]] = {1: "coil", 2: "discrete input", 5: "coil", 15: "coil"}
"""The functions that are served, and the table that each is about."""


def serve(settings: Any, plants: Mapping[str, Plant], config: Any, bus_name: str) -> "ModbusServer":
    """Serve the devices of this bus on a free port of 127.0.0.1."""
    devices = wirings(config, bus_name, plants, canonical)
    return ModbusServer(devices, slow_s=1.5 * settings.timeout_s)


class Units:
    """What pymodbus's server asks for and sets: the bits of all units. `slow_s`: a slow reply's delay.

    Coils keep what was written; inputs are what the plants' contacts show.
    """

    def __init__(self, devices: Iterable[Wiring], slow_s: float) -> None:
        self._slow_s = slow_s
        self._at: dict[Point, tuple[Wiring, str]] = {}
        self._plants: dict[int | None, list[Plant]] = {None: []}
        for wiring in devices:
            points = {parse(name): name for name in (*wiring.inputs, *wiring.outputs)}
            self._at.update({point: (wiring, name) for point, name in points.items()})
            for unit in (None, *{point.unit for point in points}):
                self._plants.setdefault(unit, []).append(wiring.plant)
        self._coils: dict[Point, bool] = {}
        self._before: dict[Point, bool] = {}

    def failure(self, part: Part, unit: int | None = None) -> FailureMode | None:
        """How the server, or this unit, is told to fail."""
        modes = (plant.failures.get(part) for plant in self._plants.get(unit, ()))
        return next((mode for mode in modes if mode is not None), None)

    async def async_getValues(
        self, device_id: int, func_code: int, address: int, count: int = 1
    ) -> list[bool] | ExcCodes:
        """The bits of a read request, or of a write's echo."""
        points = await self._points(device_id, func_code, address, count)
        if isinstance(points, ExcCodes):
            return points
        return [self._bit(point) for point in points]

    async def async_setValues(
        self, device_id: int, func_code: int, address: int, values: list[bool]
    ) -> ExcCodes | None:
        """A write to coils."""
        points = await self._points(device_id, func_code, address, len(values))
        if isinstance(points, ExcCodes):
            return points
        for point, value in zip(points, values, strict=True):
            wiring, name = self._at[point]
            self._coils[point] = bool(value)
            if name in wiring.outputs:
                wiring.drive(name, bool(value), time.monotonic())
        return None

    async def _points(
        self, unit: int, function: int, address: int, count: int
    ) -> list[Point] | ExcCodes:
        """The points that a request is about; or the exception, or the silence, that answers it."""
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
        if any(point not in self._at for point in points):
            return ExcCodes.ILLEGAL_ADDRESS
        return points

    def _bit(self, point: Point) -> bool:
        wiring, name = self._at[point]
        if name not in wiring.inputs:
            return self._coils.get(point, False)
        if self.failure("unit", point.unit) != "stuck":
            self._before[point] = wiring.levels(time.monotonic())[name]
        return self._before.get(point, False)


class ModbusServer:
    """The running server, with an asyncio loop in a thread of its own.

    `replace`: what must stand in the bus's settings instead.
    """

    def __init__(self, devices: Iterable[Wiring], slow_s: float) -> None:
        self._units = Units(devices, slow_s)
        self._noise = random.Random("modbus")
        self._port = 0
        self._server: Any = None
        self._closed = False
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="modbus", daemon=True)
        self._thread.start()
        self._run(self._listen())
        self._watch = asyncio.run_coroutine_threadsafe(self._look(), self._loop)
        self.replace = {"tcp": {"host": "127.0.0.1", "port": self._port}}

    def close(self) -> None:
        """Hang up on everybody. May be called twice."""
        if self._closed:
            return
        self._closed = True
        self._watch.cancel()
        self._run(self._hang_up())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _run(self, work: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(READY_S)

    async def _listen(self) -> None:
        self._server = ModbusTcpServer(
            _placeholder(),
            address=("127.0.0.1", self._port),
            ignore_missing_devices=True,
            trace_packet=self._send,
        )
        self._server.context = self._units
        await self._server.serve_forever(background=True)
        self._port = self._server.transport.sockets[0].getsockname()[1]

    async def _hang_up(self) -> None:
        if self._server is not None:
            server, self._server = self._server, None
            await server.shutdown()
        await asyncio.sleep(0)  # the connections close in the loop's next round

    async def _look(self) -> None:
        """Be off while told so."""
        while True:
            off = self._units.failure("server") == "off"
            if off and self._server is not None:
                await self._hang_up()
            elif not off and self._server is None:
                await self._listen()
            await asyncio.sleep(LOOK_S)

    def _send(self, sending: bool, packet: bytes) -> bytes:
        """What really goes onto the wire."""
        if not sending:
            return packet
        server = self._units.failure("server")
        if "garbage" in (server, self._units.failure("unit", packet[6])):
            return self._noise.randbytes(self._noise.randrange(1, 30))
        if server == "wrong":
            return bytes((packet[0] ^ 0x55,)) + packet[1:]
        return packet


def _placeholder() -> SimDevice:
    """pymodbus wants to hold the registers itself; ours are the plants'."""
    return SimDevice(0, simdata=SimData(0, datatype=DataType.REGISTERS))
