"""TCP connections with one deadline for a whole call, even if the server misbehaves.

A timeout of requests or of a socket covers only a single wait. A server that sends a byte from time to
time would keep the caller waiting for ever. In this file every wait of a call gets only the call's
remaining time. The waits are the name lookup, the connection, each send and each receive.
"""

import ipaddress
import os
import queue
import socket
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import ssl

    from _typeshed import ReadableBuffer, WriteableBuffer

SocketAddress = tuple[str, int] | tuple[str, int, int, int] | tuple[int, bytes]
Address = tuple[socket.AddressFamily, socket.SocketKind, int, str, SocketAddress]
"""Family, kind, protocol, canonical name and address, as socket.getaddrinfo returns them."""


class Resolve(Protocol):
    """The name lookup. Tests replace `socket.getaddrinfo`."""

    def __call__(self, host: str, port: int, *, type: int) -> Sequence[Address]:
        """Return the addresses of this name. Raises OSError."""


class Deadline:
    """The end of the current call, in monotonic seconds."""

    def __init__(self) -> None:
        self.at = 0.0

    def start(self, timeout_s: float) -> None:
        """Begin a call."""
        self.at = time.monotonic() + timeout_s

    def left(self) -> float:
        """Return the call's remaining time (s). Raises TimeoutError when no time is left."""
        left_s = self.at - time.monotonic()
        if left_s <= 0:
            raise TimeoutError("the call's time is up")
        return left_s

    def passed(self) -> bool:
        """Has the deadline passed?"""
        return time.monotonic() >= self.at


class DeadlineSocket(socket.socket):
    """A TCP socket whose waits all end by the deadline of the current call."""

    deadline: Deadline

    def recv_into(self, buffer: "WriteableBuffer", nbytes: int = 0, flags: int = 0) -> int:
        """Receive within the deadline. http.client does all its reading through this method."""
        self.settimeout(self.deadline.left())
        return super().recv_into(buffer, nbytes, flags)

    def sendall(self, data: "ReadableBuffer", flags: int = 0) -> None:
        """Send within the deadline. One timeout suffices, because the timeout of socket.sendall covers
        the whole send."""
        self.settimeout(self.deadline.left())
        super().sendall(data, flags)


def tls_socket(deadline: Deadline) -> "type[ssl.SSLSocket]":
    """Make a class of TLS sockets whose waits all end by the deadline.

    A TLS socket inherits only the timeout of the plain socket, not the methods of DeadlineSocket. So
    this class checks the deadline itself.
    """
    import ssl

    class DeadlineTls(ssl.SSLSocket):
        def recv_into(
            self, buffer: "WriteableBuffer", nbytes: int | None = None, flags: int = 0
        ) -> int:
            self.settimeout(deadline.left())
            return super().recv_into(buffer, nbytes, flags)

        def send(self, data: "ReadableBuffer", flags: int = 0) -> int:
            self.settimeout(deadline.left())
            return super().send(data, flags)

    return DeadlineTls


class Dialler:
    """The object that opens all connections to one host. `dialled` is the number of connections opened
    so far. `failure` is the last error.

    Tests replace `resolve`, which is socket.getaddrinfo.
    """

    def __init__(self, host: str, port: int, resolve: Resolve = socket.getaddrinfo) -> None:
        self.deadline = Deadline()
        self.dialled = 0
        self.failure: OSError | None = None
        self._host = host
        self._port = port
        self._resolve = resolve
        self._lookup: threading.Thread | None = None
        self._last: socket.socket | None = None

    def dial(self) -> socket.socket:
        """Open a new connection. All addresses of the host share the remaining time. Raises OSError."""
        self.dialled += 1
        try:
            self._last = self._first_of(self._addresses())
            return self._last
        except OSError as error:
            self.failure = error
            raise

    def hang_up(self) -> None:
        """Close the last connection, even if a file object of the connection is still open."""
        last, self._last = self._last, None
        descriptor = -1 if last is None else last.detach()
        if descriptor != -1:
            os.close(descriptor)

    def _first_of(self, addresses: Sequence[Address]) -> socket.socket:
        failure = OSError("the name has no address")
        for n, address in enumerate(addresses):
            try:
                return self._connected(address, self.deadline.left() / (len(addresses) - n))
            except OSError as error:
                failure = error
        raise failure

    def _connected(self, address: Address, timeout_s: float) -> socket.socket:
        family, kind, protocol, _, where = address
        sock = DeadlineSocket(family, kind, protocol)
        sock.deadline = self.deadline
        try:
            sock.settimeout(timeout_s)
            sock.connect(where)
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.settimeout(self.deadline.left())  # so that a TLS handshake has a timeout
        except OSError:
            sock.close()
            raise
        return sock

    def _addresses(self) -> Sequence[Address]:
        """Look up the host's addresses. The lookup runs in a thread, because getaddrinfo has no
        timeout."""
        if _is_numeric(self._host):
            return socket.getaddrinfo(self._host, self._port, type=socket.SOCK_STREAM)
        if self._lookup is not None and self._lookup.is_alive():
            raise TimeoutError("the name's last lookup has not ended yet")
        answer: queue.SimpleQueue[Sequence[Address] | OSError] = queue.SimpleQueue()
        self._lookup = threading.Thread(target=self._look_up, args=(answer,), daemon=True)
        self._lookup.start()
        try:
            found = answer.get(timeout=self.deadline.left())
        except queue.Empty:
            raise TimeoutError("the name's lookup takes too long") from None
        self._lookup = None  # forget the thread: it has answered, and will end
        if isinstance(found, OSError):
            raise found
        return found

    def _look_up(self, answer: "queue.SimpleQueue[Sequence[Address] | OSError]") -> None:
        try:
            answer.put(self._resolve(self._host, self._port, type=socket.SOCK_STREAM))
        except OSError as error:
            answer.put(error)


def _is_numeric(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
