"""Modbus TCP: one connection, one question, one deadline. Imported with the first bus that needs it."""

import socket
from typing import Final

from drivers.hal.deadline import Dialler, Resolve
from drivers.hal.modbus import frames
from drivers.hal.modbus.wire import Answer, BadReply, NoReply, Question, Unreachable

NUMBERS: Final = 0xFFFF
"""Transactions are numbered from 1 to this; a reply to number 0 would be taken for any."""


class Connection:
    """The way to one host, made anew when it is needed. `resolve` is a test's in place of DNS."""

    def __init__(
        self, host: str, port: int, timeout_s: float, resolve: Resolve = socket.getaddrinfo
    ) -> None:
        self._timeout_s = timeout_s
        self._where = f"{host}:{port}"
        self._dialler = Dialler(host, port, resolve)
        self._socket: socket.socket | None = None
        self._number = 0  # goes on over connections: no late reply may match on a new one

    def owes(self, unit: int) -> bool:
        """Never: replies have numbers here, and no late one can be taken for another's."""
        return False

    def begin(self, unit: int) -> None:
        """A new question comes."""

    def connect(self) -> None:
        """Have a connection; a try begins here. Raises Unreachable."""
        self._dialler.deadline.start(self._timeout_s)
        if self._socket is None:
            try:
                self._socket = self._dialler.dial()
            except OSError as error:
                raise Unreachable(self._unreachable(error)) from error

    def ask(self, question: Question) -> Answer:
        """What answers this question; else hang up. Raises NoReply."""
        try:
            return self._answer(question)
        except (OSError, BadReply) as error:
            self.close()
            raise NoReply(self._reason(error)) from error

    def close(self) -> None:
        """Close the connection. May be called twice."""
        connection, self._socket = self._socket, None
        if connection is not None:
            connection.close()

    def _answer(self, question: Question) -> Answer:
        """Ask, and hear replies until one is to this question. Raises OSError, BadReply."""
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
        """What comes next. Raises OSError, TimeoutError among them."""
        assert self._socket is not None
        self._socket.settimeout(self._dialler.deadline.left())
        received = self._socket.recv(4096)
        if not received:
            raise ConnectionResetError("the far side hung up")
        return received

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
        if isinstance(error, TimeoutError):
            return f"no reply within {self._timeout_s:g} s"
        if isinstance(error, OSError):
            return f"the connection broke ({error.strerror or error})"
        return f"no Modbus reply to it ({error})"
