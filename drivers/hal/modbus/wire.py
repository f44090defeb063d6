"""One Modbus TCP connection through pymodbus's synchronous client: one question, one deadline.

Here pymodbus is kept to what it is good at, frames and their contents. Left to itself it waits for
the timeout anew after each byte and by the wall clock, looks up names without limit, repeats requests
on a connection that may still hold late replies, and takes the reply to another function for an
answer. Only `pymodbus.client` is imported, and not before the first connection: its server costs
15 MB.
"""

import functools
import logging
import select
import socket
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from drivers.hal.deadline import Deadline, Dialler, Resolve
from drivers.hal.modbus.replies import register_replies

if TYPE_CHECKING:
    from pymodbus.client.mixin import ModbusClientMixin
    from pymodbus.pdu import ModbusPDU

Call = Callable[["ModbusClientMixin[ModbusPDU]"], "ModbusPDU"]
"""Asks one question of a client, and says BadReply when the reply does not answer it."""


class Unreachable(Exception):
    """There is no connection; the text says why."""


class NoReply(Exception):
    """Nothing has come in time, or nothing that answers; the connection is closed."""


class BadReply(Exception):
    """For a Call to raise: the reply decodes, and does not answer what was asked."""


class Connection:
    """The way to one host, made anew when it is needed. `resolve` is a test's in place of DNS."""

    def __init__(
        self, host: str, port: int, timeout_s: float, resolve: Resolve = socket.getaddrinfo
    ) -> None:
        self._timeout_s = timeout_s
        self._where = f"{host}:{port}"
        self._dialler = Dialler(host, port, resolve)
        self._client: Any = None
        self._last_number = 0

    def owes(self, unit: int) -> bool:
        """May this unit still answer an older question, so that a new one had better wait?"""
        return False

    def begin(self, unit: int) -> None:
        """A new question comes. Replies have numbers here: no late one can be taken for another's."""

    def connect(self) -> None:
        """Have a connection; a try begins here. Raises Unreachable."""
        make = _client_class()  # a Pi loads the library for longer than a try may last
        self._dialler.deadline.start(self._timeout_s)
        if self._client is None:
            try:
                connection = self._dialler.dial()
            except OSError as error:
                raise Unreachable(self._unreachable(error)) from error
            self._client = make(connection, self._dialler.deadline, self._last_number)

    def ask(self, function: int, call: Call) -> "ModbusPDU":
        """The answer to one request: of this function, or an exception. Raises NoReply."""
        try:
            reply = call(self._client)
            if reply.function_code & 0x7F != function:
                raise BadReply(f"function {reply.function_code} instead of {function}")
        except failures() as error:
            self.close()
            raise NoReply(self._reason(error)) from error
        return reply

    def close(self) -> None:
        """Hang up. May be called twice."""
        if self._client is not None:
            self._last_number = self._client.transaction.next_tid
            self._client.close()
            self._client = None

    def _unreachable(self, error: OSError) -> str:
        text = f"no Modbus TCP connection to {self._where}: "
        if isinstance(error, ConnectionRefusedError):
            return text + "it is refused; is this the module, and does it take more connections?"
        if isinstance(error, socket.gaierror):
            return text + "its name is not known; write its address"
        if isinstance(error, TimeoutError):
            return text + f"nobody answers within {self._timeout_s:g} s; check power and cable"
        return text + (error.strerror or str(error))

    def _reason(self, error: Exception) -> str:
        from pymodbus.exceptions import ConnectionException, ModbusIOException

        if isinstance(error, ModbusIOException) and self._dialler.deadline.passed():
            return f"no reply within {self._timeout_s:g} s"
        if isinstance(error, ConnectionException):
            return "the connection broke"
        if isinstance(error, OSError):
            return f"the connection broke ({error.strerror or error})"
        return f"no Modbus reply to it ({error})"


@functools.cache
def failures() -> tuple[type[Exception], ...]:
    """What a request can raise: pymodbus's own, the socket's, and what its decoders let through."""
    from pymodbus.exceptions import ModbusException

    return (ModbusException, BadReply, OSError, struct.error, IndexError, ValueError)


@functools.cache
def strict_replies() -> tuple[Any, ...]:
    """pymodbus's replies, refusing what theirs let through: for `register` of a client or decoder."""
    from pymodbus.pdu.bit_message import ReadCoilsResponse, WriteSingleCoilResponse

    class Bits(ReadCoilsResponse):
        def decode(self, data: bytes) -> None:
            if len(data) < 2 or data[0] != len(data) - 1:
                raise ValueError("its byte count is wrong")
            super().decode(data)

    class Echo(WriteSingleCoilResponse):
        def decode(self, data: bytes) -> None:
            if len(data) != 4:
                raise ValueError("it is no coil's value")
            super().decode(data)
            self.registers = [int.from_bytes(data[2:], "big")]  # `bits` would take any for 1

    class Inputs(Bits):
        function_code = 2

    logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)  # our HalErrors say it all
    return (Bits, Inputs, Echo, *register_replies())


@functools.cache
def _client_class() -> Any:
    """pymodbus's client on a connection of ours, with our deadline, and strict decoders."""
    from pymodbus.client import ModbusTcpClient
    from pymodbus.exceptions import ConnectionException

    class Client(ModbusTcpClient):
        def __init__(self, connection: socket.socket, deadline: Deadline, number: int) -> None:
            super().__init__("", retries=0)
            self.transaction.next_tid = number  # a late reply must not match on a new connection
            self.socket = connection
            for reply in strict_replies():
                self.register(reply)
            self._deadline = deadline

        def recv(self, size: int | None) -> bytes:
            """What has come; nothing when the time is up."""
            assert self.socket is not None
            try:
                left_s = self._deadline.left()
            except TimeoutError:
                return b""
            if not select.select([self.socket], [], [], left_s)[0]:
                return b""
            received = self.socket.recv(4096)
            if not received:
                raise ConnectionException("the far side hung up")
            return received

    return Client
