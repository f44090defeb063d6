"""Modbus TCP: one connection, one request at a time, one deadline. A bus imports this file when it
needs TCP."""

import socket
from typing import Final

from drivers.hal.deadline import Dialler, Resolve
from drivers.hal.modbus import frames
from drivers.hal.modbus.wire import BadReply, NoReply, UnitReply, UnitRequest, Unreachable

NUMBERS: Final = 0xFFFF
"""The highest transaction number. The lowest is 1. The number 0 is not used, because gateways that do
not number their replies send 0."""


class Connection:
    """The connection to one host. It opens again when needed. Tests replace `resolve` (DNS)."""

    def __init__(
        self, host: str, port: int, timeout_s: float, resolve: Resolve = socket.getaddrinfo
    ) -> None:
        self._timeout_s = timeout_s
        self._where = f"{host}:{port}"
        self._dialler = Dialler(host, port, resolve)
        self._socket: socket.socket | None = None
        self._number = 0  # never restarts at 1, so no late reply of an old connection matches

    def owes(self, unit: int) -> bool:
        """Return False, because replies have numbers. So a late reply cannot pass for a new reply."""
        return False

    def begin(self, unit: int) -> None:
        """Do nothing, because no late reply can pass for a new reply."""

    def connect(self) -> None:
        """Connect if necessary, and start the time limit of one try. Raises Unreachable."""
        self._dialler.deadline.start(self._timeout_s)
        if self._socket is None:
            try:
                self._socket = self._dialler.dial()
            except OSError as error:
                raise Unreachable(self._unreachable(error)) from error

    def ask(self, question: UnitRequest) -> UnitReply:
        """Send this request, and return its answer. If no answer comes, close the connection and raise
        NoReply."""
        try:
            return self._answer(question)
        except (OSError, BadReply) as error:
            self.close()
            raise NoReply(self._reason(error)) from error

    def close(self) -> None:
        """Close the connection. The caller may call `close` twice."""
        connection, self._socket = self._socket, None
        if connection is not None:
            connection.close()

    def _answer(self, question: UnitRequest) -> UnitReply:
        """Send the request, and read replies until the reply to this request comes. Raises OSError or
        BadReply."""
        assert self._socket is not None
        self._number = self._number % NUMBERS + 1
        self._socket.sendall(frames.tcp_request(question, self._number))
        heard = b""
        while True:
            heard += self._heard()
            used, answer = frames.tcp_answer(question, self._number, heard)
            if answer is not None:
                return answer
            heard = heard[used:]

    def _heard(self) -> bytes:
        """Return the next bytes. Raises OSError. Raises TimeoutError when the time of the try is
        over."""
        assert self._socket is not None
        self._socket.settimeout(self._dialler.deadline.left())
        received = self._socket.recv(4096)
        if not received:
            raise ConnectionResetError("the far side has closed the connection")
        return received

    def _unreachable(self, error: OSError) -> str:
        text = f"no Modbus TCP connection to {self._where}: "
        if isinstance(error, ConnectionRefusedError):
            return text + "refused; is the address right, and has the module a free connection?"
        if isinstance(error, socket.gaierror):
            return text + "the host's name is not known; write its address"
        if isinstance(error, TimeoutError):
            return text + f"nobody answers within {self._timeout_s:g} s; check power and cable"
        return text + (error.strerror or str(error))

    def _reason(self, error: Exception) -> str:
        if isinstance(error, TimeoutError):
            return f"no reply within {self._timeout_s:g} s"
        if isinstance(error, OSError):
            return f"the connection broke ({error.strerror or error})"
        return f"no Modbus reply to the request ({error})"
