"""Servers on 127.0.0.1 without an HTTP library. A test chooses each byte of the answers."""

import contextlib
import socket
import threading
from collections.abc import Callable

Conversation = Callable[["Caller"], None]


class Caller:
    """One connection, from the server's side."""

    def __init__(self, sock: socket.socket, closing: threading.Event) -> None:
        self._sock = sock
        self._closing = closing

    def request(self) -> bytes:
        """Return the head of the next request, or b"" if the caller has hung up."""
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            byte = self._sock.recv(1)
            if not byte:
                return b""
            head += byte
        return head

    def send(self, *parts: bytes) -> None:
        """Send each part in a separate TCP segment."""
        for part in parts:
            self._sock.sendall(part)

    def for_ever(self, part: bytes, every_s: float = 0.01) -> None:
        """Send this part again and again, until the caller hangs up."""
        while not self._closing.wait(every_s):
            self._sock.sendall(part)

    def hold(self) -> None:
        """Keep the connection open and send nothing, until the caller hangs up."""
        self._sock.recv(1)


class FarEnd:
    """A server that takes the next conversation for each new connection.

    Further connections repeat the last conversation. `requests` has the heads of all requests, and
    `connections` is the number of connections.
    """

    def __init__(self, *conversations: Conversation) -> None:
        self.conversations = list(conversations)
        self.requests: list[bytes] = []
        self.connections = 0
        self._closing = threading.Event()
        self._callers: list[tuple[socket.socket, threading.Thread]] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def __enter__(self) -> "FarEnd":
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._listener.shutdown(socket.SHUT_RDWR)
        self._thread.join()
        self._listener.close()
        for sock, thread in self._callers:
            with contextlib.suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)
            thread.join()
            sock.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                sock, _ = self._listener.accept()
                talk = self.conversations[min(self.connections, len(self.conversations) - 1)]
                self.connections += 1
                thread = threading.Thread(target=self._talk, args=(sock, talk), daemon=True)
                self._callers.append((sock, thread))
                thread.start()

    def _talk(self, sock: socket.socket, talk: Conversation) -> None:
        caller = Caller(sock, self._closing)
        with contextlib.suppress(OSError):
            request = caller.request
            caller.request = lambda: self._noted(request())  # type: ignore[method-assign]
            talk(caller)
            sock.shutdown(socket.SHUT_RDWR)

    def _noted(self, head: bytes) -> bytes:
        if head:
            self.requests.append(head)
        return head


def answer(
    body: bytes = b'{"state": 0}', status: str = "200 OK", headers: str = "", sort: str = "json"
) -> bytes:
    """Return a complete HTTP answer."""
    head = f"HTTP/1.1 {status}\r\nContent-Type: application/{sort}\r\n{headers}"
    return f"{head}Content-Length: {len(body)}\r\n\r\n".encode("latin-1") + body


def always(*parts: bytes) -> Conversation:
    """Return a conversation that gives this answer to every request of a connection."""

    def talk(caller: Caller) -> None:
        while caller.request():
            caller.send(*parts)

    return talk


def once(*parts: bytes) -> Conversation:
    """Return a conversation that gives this answer to one request, and then hangs up."""

    def talk(caller: Caller) -> None:
        caller.request()
        caller.send(*parts)

    return talk
