"""An I/O module in fifty lines on sockets, written from the Modbus specification without pymodbus.

`asked` has the bytes of each request. A test can choose any answer.
"""

import socket
import struct
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import msgspec
import pytest

from drivers.hal.modbus import ModbusBus, ModbusSettings, Serial, Tcp
from drivers.hal.modbus.watchdog import Watchdog
from drivers.hal.points import HalError
from tests.waiting import at_last

Reply = Callable[[bytes], bytes | None]
"""A function that gets a request's bytes and returns the answer's bytes. With None the module hangs
up."""


class Module:
    """A module behind one listening socket. Its units have coils and inputs.

    A test may replace `reply`. With `hangs_up` the module hangs up after each reply. `where` is the
    name by which the bus's texts call the module.
    """

    def __init__(self, reply: Reply | None = None) -> None:
        self.reply: Reply = reply or self.answer
        self.asked: list[bytes] = []
        self.connections = 0
        self.hangs_up = False
        self.units: set[int] = {1}
        self.coils: dict[tuple[int, int], bool] = {}
        self.inputs: dict[tuple[int, int], bool] = {}
        self._ends: list[socket.socket] = []
        self._listen()

    def _listen(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int | str = self._listener.getsockname()[1]
        self.where = f"127.0.0.1:{self.port}"
        self._threads = [self._started(self._accept)]

    def functions(self) -> list[int]:
        """Return the function code of each request so far."""
        return [request[7] for request in self.asked]

    def units_asked(self) -> list[int]:
        """Return the unit of each request so far."""
        return [request[6] for request in self.asked]

    def answer(self, request: bytes) -> bytes:
        """Return the answer that Modbus Application Protocol V1.1b3, 6.1, 6.2 and 6.5 demand.

        Other requests get no answer.
        """
        unit, function, address, value = struct.unpack(">BBHH", request[6:12])
        if unit not in self.units:
            return b""
        if function == 5:
            self.coils[unit, address] = value == 0xFF00
            return frame(request, request[7:12])
        table = self.coils if function == 1 else self.inputs
        bits = [table.get((unit, address + i)) for i in range(value)]
        if None in bits:
            return frame(request, bytes((function | 0x80, 2)))
        packed = sum(bool(bit) << i for i, bit in enumerate(bits))
        return bits_reply(request, packed.to_bytes((value + 7) // 8, "little"))

    def hang_up(self) -> None:
        """Close every connection, but continue to listen."""
        for end in self._ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close every connection and stop listening."""
        with suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._threads[0].join()
        self.hang_up()
        for thread in self._threads:
            thread.join()
        for end in (self._listener, *self._ends):
            end.close()

    def _started(self, work: Callable[..., None], *args: object) -> threading.Thread:
        thread = threading.Thread(target=work, args=args, daemon=True)
        thread.start()
        return thread

    def _accept(self) -> None:
        while True:
            try:
                end, _ = self._listener.accept()
            except OSError:
                return
            self.connections += 1
            self._ends.append(end)
            self._threads.append(self._started(self._serve, end))

    def _serve(self, end: socket.socket) -> None:
        with suppress(OSError):
            while request := end.recv(260):
                self.asked.append(request)
                reply = self.reply(request)
                if reply is None:
                    break
                end.sendall(reply)
                if self.hangs_up:
                    break
        with suppress(OSError):
            end.shutdown(socket.SHUT_RDWR)
        end.close()


def frame(request: bytes, pdu: bytes) -> bytes:
    """Return a reply to this request, with this PDU and a correct MBAP header."""
    return request[:4] + struct.pack(">H", len(pdu) + 1) + request[6:7] + pdu


def bits_reply(request: bytes, packed: bytes) -> bytes:
    """Return the reply to a read of bits."""
    return frame(request, bytes((request[7], len(packed))) + packed)


class Time:
    """A clock that shows the same time until a test sets it."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def door(module: Module, unit: int = 1) -> None:
    """Give this unit a door's two inputs and one coil."""
    module.units.add(unit)
    module.inputs.update({(unit, 0): False, (unit, 1): True})
    module.coils.update({(unit, 0): False})


def fails(bus: ModbusBus, point: str) -> str:
    """Return the text of the HalError that occurs when the bus reads this point."""
    with pytest.raises(HalError) as caught:
        bus.lines({point: None}, {}).read()
    return str(caught.value)


def serial(port: str, ignore_echo: bool = False) -> Serial:
    """Return a serial line with 115200 baud."""
    return Serial(port=port, baudrate=115200, parity="none", stopbits=1, ignore_echo=ignore_echo)


def proven(
    module: Module, clock: Time | None = None, *, timeout_s: float = 2.0, retries: int = 1
) -> ModbusBus:
    """Return a bus whose unit 1 has answered once. The bus retries only requests to such a unit.

    Afterwards the module's `asked` is empty.
    """
    door(module)
    bus = bus_to(module.port, clock, timeout_s=timeout_s, retries=retries)
    read = bus.lines({"unit 1 discrete input 0": None}, {}).read
    at_last(read, "the first reading succeeds", bus.insist)
    module.asked.clear()
    return bus


opened: list[ModbusBus] = []
"""The buses that `bus_to` has opened. The conftest closes them after each test."""


def bus_to(
    port: int | str,
    clock: Time | None = None,
    *,
    timeout_s: float = 2.0,
    retries: int = 1,
    ignore_echo: bool = False,
    module_watchdog: dict[str, Any] | None = None,
) -> ModbusBus:
    """Return a bus to a port of this machine. After a failure the bus pauses. `clock` measures these
    pauses, whose lengths are not random."""
    settings = ModbusSettings(
        tcp=Tcp(host="127.0.0.1", port=port) if isinstance(port, int) else None,
        serial=serial(port, ignore_echo) if isinstance(port, str) else None,
        timeout_s=timeout_s,
        retries=retries,
        module_watchdog=msgspec.convert(module_watchdog, Watchdog | None),
    )
    opened.append(ModbusBus(settings, clock or Time(), lambda: 0.0))
    return opened[-1]
