"""The far side of a `modbus` bus: a real pymodbus TCP server on 127.0.0.1, as a gateway with units.

A bus on a serial line has a far side of its own, `hal_fakes/modbus/rtu.py`.

Each device's points are bits of its units, with the plant behind them. As at a gateway, an unknown
address gets exception 2, and an unknown unit gets exception 11. The order `fail DEVICE unit|server
MODE` lets one unit fail, or the server with all units:

- `off`: the unit is silent; the server refuses and drops connections
- `stuck`: the unit's inputs stay unchanged; the server takes requests and never answers
- `slow`: the reply comes after the client has stopped waiting
- `garbage`: the reply is bytes that are not Modbus, or half a reply
- `wrong`: the unit answers exception 4; the server answers for another transaction, or as another unit
"""

import asyncio
import itertools
import logging
import random
import sys
import threading
from collections.abc import Coroutine, Iterable, Sequence
from typing import Any, Final

from pymodbus.simulator import DataType, SimData, SimDevice

from drivers.hal.modbus import ModbusSettings
from hal_fakes.fake import Outside
from hal_fakes.modbus.dead_man import ModuleWatchdog
from hal_fakes.modbus.flash import TimedCoilRequest
from hal_fakes.modbus.rtu import RtuLine
from hal_fakes.modbus.units import FakeUnits, FarSide

_aiohttp = sys.modules.get("aiohttp")
sys.modules["aiohttp"] = None  # type: ignore[assignment]  # as if it were not installed
try:  # without this, pymodbus imports aiohttp, which takes half of the time of a start
    from pymodbus.server import ModbusTcpServer
finally:
    del sys.modules["aiohttp"]
    if _aiohttp:
        sys.modules["aiohttp"] = _aiohttp

TRANSACTION: Final = 0
UNIT: Final = 6
"""The positions (bytes) of the transaction number and of the unit in a reply on TCP."""
LOOK_S: Final = 0.02
"""The maximum delay (s) with which the server obeys `off`."""
READY_S: Final = 10.0


def serve(settings: ModbusSettings, stations: Sequence[FarSide]) -> "ModbusServer | RtuLine":
    """Serve the devices of this bus on a free port of 127.0.0.1, or on a simulated serial line."""
    dog = settings.module_watchdog
    devices = [*map(ModuleWatchdog, dog.units if dog else ()), *stations]
    if settings.serial:
        slow_s = (settings.retries + 1.2) * settings.timeout_s
        return RtuLine(devices, settings.serial, slow_s)
    return ModbusServer(devices, slow_s=1.5 * settings.timeout_s)


logging.getLogger("pymodbus").setLevel(logging.WARNING)  # keep pymodbus out of a daemon's log


class ModbusServer:
    """A running server, whose asyncio loop has a thread of its own.

    `replace` has the settings with which the real bus finds the server. `devices` are the units.
    Another server may serve the same units.
    """

    def __init__(self, devices: Iterable[FarSide] | FakeUnits, slow_s: float) -> None:
        self.units = devices if isinstance(devices, FakeUnits) else FakeUnits(devices, slow_s)
        self._noise = random.Random("modbus")
        self._kinds = itertools.cycle((0, 1))
        self._port = 0
        self._server: Any = None  # pymodbus's sockets and the server's context have no types
        self._closed = False
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="modbus", daemon=True)
        self._thread.start()
        self._run(self._listen())
        asyncio.run_coroutine_threadsafe(self._look(), self._loop)
        self.replace: dict[str, object] = {"tcp": {"host": "127.0.0.1", "port": self._port}}

    def close(self) -> None:
        """Close every connection. The caller may call `close` twice."""
        if self._closed:
            return
        self._closed = True
        self._run(self._end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _run(self, work: Coroutine[object, None, None]) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(READY_S)

    async def _listen(self) -> None:
        self._server = ModbusTcpServer(
            _placeholder(),
            address=("127.0.0.1", self._port),
            ignore_missing_devices=True,
            custom_pdu=[TimedCoilRequest],
            trace_packet=self._send,
        )
        self._server.context = self.units
        await self._server.serve_forever(background=True)
        self._port = self._server.transport.sockets[0].getsockname()[1]

    async def _hang_up(self) -> None:
        if self._server is not None:
            server, self._server = self._server, None
            await server.shutdown()
        await asyncio.sleep(0)  # the connections close in the next round of the loop

    async def _end(self) -> None:
        """Close every connection, and end every task. A request that is answered slowly may still have
        one. asyncio would log such a task as an error whenever it is freed, even much later."""
        await self._hang_up()
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _look(self) -> None:
        """Stop the server when its failure `off` begins, and start it when the failure ends. Let
        watchdogs trip."""
        while True:
            self.units.tick()
            off = self.units.failure("server") == "off"
            if off and self._server is not None:
                await self._hang_up()
            elif not off and self._server is None:
                await self._listen()
            await asyncio.sleep(LOOK_S)

    def _send(self, sending: bool, packet: bytes) -> bytes:
        """Return the bytes to put onto the wire."""
        if not sending:
            return packet
        server = self.units.failure("server")
        if "garbage" in (server, self.units.failure("unit", packet[6])):
            noise = self._noise.randbytes(self._noise.randrange(1, 30))
            return packet[: len(packet) // 2] if next(self._kinds) else noise
        if server == "wrong":
            at = UNIT if next(self._kinds) else TRANSACTION
            return packet[:at] + bytes((packet[at] ^ 0x55,)) + packet[at + 1 :]
        return packet


def _placeholder() -> SimDevice:
    """Make the registers that pymodbus demands. Nobody uses them, because the plants have the real
    registers."""
    return SimDevice(0, simdata=SimData(0, datatype=DataType.REGISTERS))


FAKE = Outside(serve)
