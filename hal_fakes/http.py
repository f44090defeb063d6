"""The far side of an `http` bus: a real HTTP server on 127.0.0.1 in front of stations.

Each sort of station has a file that makes its answers, such as `hal_fakes/http_charger.py`. The wire
has parts that fail in several modes (`hal_fakes.plants.plant.FAILURE_MODES`):

|         | off            | stuck               | slow               | garbage        | wrong         |
| server  | closes at once | repeats last answer | answers too late   | an HTML page   | state as text |
| headers | closes halfway | stops halfway       | one byte at a time | not HTTP       | status 500    |
| body    | empty          | stops halfway       | one byte at a time | malformed JSON | unknown state |
"""

import contextlib
import socket
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from select import select
from types import MappingProxyType
from typing import Any, Final, Protocol, runtime_checkable

from drivers.hal import http
from hal_fakes.fake import Outside
from hal_fakes.plants.plant import FailureMode, Plant

LOOK_S: Final = 0.05
NEVER: Final = float("inf")
PAGE: Final = b"<!doctype html><title>Welcome</title>"

Failures = Mapping[str, FailureMode]
NONE: Final[Failures] = MappingProxyType({})


def serve(
    settings: http.HttpSettings, stations: Sequence["HttpStation | FreeStation"]
) -> "HttpServer":
    """Serve the stations of this bus on a free port of 127.0.0.1."""
    path = http.base(settings.api_base).path
    return HttpServer(stations, path, settings.timeout_s, settings.push_path or "")


Asked = tuple[str, str, str]
"""A request: its method, its path below `api_base`, and its body. A request without a body has ""."""
ANY_BODY: Final = "*"
"""A mark in place of the body in a command's request. The mark means that the body differs from call to
call."""


class HttpStation(Protocol):
    """A controller with a plant behind it.

    `reads` are the requests for the controller's state. `commands` gives for each request its signal,
    and whether the request asserts the signal.
    """

    plant: Plant
    reads: Sequence[Asked]
    commands: Mapping[Asked, tuple[str, bool]]

    def answer(self, asked: Asked) -> bytes:
        """Return the body of the answer to a reading now."""

    def obey(self, signal: str, asserted: bool) -> None:
        """Obey a command for this signal."""

    def tick(self) -> None:
        """Switch off every output whose timer has run out. The server calls `tick` often."""


@runtime_checkable
class FreeStation(Protocol):
    """A station that reads values of a command from the path and body of a request. So its requests
    cannot be listed in advance."""

    plant: Plant

    def reply(self, method: str, path: str, body: bytes, all_stations: Any) -> bytes | None:
        """Answer a call. Return None if the call is not for this station."""


class HttpServer:
    """A running HTTP server. `replace` has the settings with which the real bus finds the server.

    `path` is the API's path. `timeout_s` is the client's deadline (s). An answer in the mode `slow`
    takes longer than this deadline. `push_path` is the WebSocket's path below `path`, if the controller
    has a WebSocket.
    """

    def __init__(
        self,
        stations: Sequence[HttpStation | FreeStation],
        path: str,
        timeout_s: float,
        push_path: str = "",
    ) -> None:
        self._server = _Listener(stations, path, timeout_s, push_path)
        host, port = self._server.server_address[:2]
        without = dict.fromkeys(("token_file", "token_header", "login", "ca_file"))
        self.replace: dict[str, object] = {"api_base": f"{host!s}:{port}{path}", **without}
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(LOOK_S,), name="http", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Close every connection. The caller may call `close` twice."""
        self._server.shutdown()
        self._server.hang_up()
        self._server.server_close()
        self._thread.join()


class _Listener(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(
        self,
        all_stations: Sequence[HttpStation | FreeStation],
        path: str,
        timeout_s: float,
        push_path: str,
    ) -> None:
        self.api = path
        self.free = [each for each in all_stations if isinstance(each, FreeStation)]
        stations = [each for each in all_stations if not isinstance(each, FreeStation)]
        self.reads = {asked: station for station in stations for asked in station.reads}
        self.commands = {asked: (s, *does) for s in stations for asked, does in s.commands.items()}
        self.timeout_s = timeout_s
        self.push_path = push_path
        self.stations = stations
        self._callers: set[socket.socket] = set()
        self._lock = threading.Lock()
        super().__init__(("127.0.0.1", 0), _Call)

    def service_actions(self) -> None:
        """Call `tick` of each station. The server calls this between requests."""
        for station in self.stations:
            station.tick()

    def get_request(self) -> tuple[socket.socket, object]:
        caller, address = super().get_request()
        with self._lock:
            self._callers.add(caller)
        return caller, address

    def shutdown_request(self, request: socket.socket | tuple[bytes, socket.socket]) -> None:
        assert isinstance(request, socket.socket)  # only a datagram server would get a pair
        with self._lock:
            self._callers.discard(request)
        super().shutdown_request(request)

    def hang_up(self) -> None:
        """Close every connection."""
        with self._lock:
            callers = list(self._callers)
        for caller in callers:
            with contextlib.suppress(OSError):
                caller.shutdown(socket.SHUT_RDWR)

    def handle_error(
        self, request: socket.socket | tuple[bytes, socket.socket], client_address: object
    ) -> None:
        """Ignore the error of a caller that has closed the connection. Raise any other error, because
        it is a defect of this file."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Call(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    server: _Listener

    def do_GET(self) -> None:
        if self.server.push_path and self.path == self.server.api + self.server.push_path:
            self._push()
            return
        body = self.rfile.read(int(self.headers.get("Content-Length", "0"))).decode()
        if self.server.free:
            self._free(body.encode())
            return
        asked = (self.command, self.path.removeprefix(self.server.api), body)
        commands = self.server.commands
        command = commands.get(asked) or commands.get((*asked[:2], ANY_BODY))
        if command:
            station, signal, asserted = command
            failures = station.plant.failures
            if failures.get("server") is None:
                station.obey(signal, asserted)
            self._answer(200, b"{}", failures)
        elif asked in self.server.reads:
            self._read(self.server.reads[asked], asked)
        else:
            self._answer(404, b"{}")

    do_POST = do_PUT = do_GET

    def _free(self, sent: bytes) -> None:
        """Pass the call to the station that the call is for. A failure of one station is a failure of
        all."""
        path, failures = self.path.removeprefix(self.server.api), dict[str, FailureMode]()
        for station in self.server.free:
            failures |= station.plant.failures
        server = failures.get("server")
        if server == "off":
            self.close_connection = True
            return
        if server == "slow":
            self._wait(2 * self.server.timeout_s)
        replies = (s.reply(self.command, path, sent, self.server.free) for s in self.server.free)
        answer = next((reply for reply in replies if reply is not None), None)
        if answer is None:
            self._answer(404, b"{}")
        elif server == "garbage":
            self._answer(200, PAGE, failures, "text/html")
        else:
            self._answer(200, answer, failures)

    def _read(self, station: HttpStation, asked: Asked) -> None:
        failures, body = station.plant.failures, station.answer(asked)
        if failures.get("server") == "slow":
            self._wait(2 * self.server.timeout_s)
        if failures.get("server") == "garbage":
            self._answer(200, PAGE, failures, "text/html")
        else:
            self._answer(200, body, failures)

    def _push(self) -> None:
        """Serve a WebSocket. At each change of a state, send a message without content."""
        from websockets.http11 import Request
        from websockets.protocol import OPEN
        from websockets.server import ServerProtocol

        protocol = ServerProtocol()
        head = "".join(f"{name}: {value}\r\n" for name, value in self.headers.items())
        protocol.receive_data(f"{self.requestline}\r\n{head}\r\n".encode())
        (request,) = protocol.events_received()
        assert isinstance(request, Request)
        protocol.send_response(protocol.accept(request))
        self.wfile.write(b"".join(protocol.data_to_send()))
        before: list[bytes] = []
        while all(s.plant.failures.get("server") is None for s in self.server.stations):
            if select([self.connection], [], [], LOOK_S)[0]:
                protocol.receive_data(self.connection.recv(4096))
            found = [station.answer(asked) for asked, station in self.server.reads.items()]
            if found != before and protocol.state is OPEN:
                protocol.send_text(b"{}")
            before = found
            self.wfile.write(b"".join(protocol.data_to_send()))
            if protocol.state is not OPEN:
                break
        self.close_connection = True

    def _answer(
        self, status: int, body: bytes, failures: Failures = NONE, sort: str = "application/json"
    ) -> None:
        headers = failures.get("headers")
        status = 500 if headers == "wrong" else status
        head = (
            f"HTTP/1.1 {status} {self.responses[status][0]}\r\n"
            f"Content-Type: {sort}\r\nContent-Length: {len(body)}\r\n\r\n"
        ).encode()
        if headers == "garbage":
            head = b"SSH-2.0-OpenSSH_9.2\r\n"
        self.close_connection = self._send(head, body, failures)

    def _send(self, head: bytes, body: bytes, failures: Failures) -> bool:
        """Write the part of an answer that the failure lets through. Return True if the connection must
        be closed.

        Write head and body at once. With two writes each answer would take 40 ms (delayed ACK).
        """
        whole = head + body
        if failures.get("server") == "off":
            return True
        for part, cut in (("headers", 20), ("body", len(head) + len(body) // 2)):
            mode = failures.get(part)
            if mode in ("stuck", "slow") or (part, mode) == ("headers", "off"):
                self.wfile.write(whole[:cut])
                if mode != "off":
                    self._wait(NEVER if mode == "stuck" else 0.0)
                    self._trickle(whole[cut:])
                return True
        self.wfile.write(whole)
        return failures.get("headers") == "garbage"

    def _trickle(self, rest: bytes) -> None:
        """Send byte by byte, slowly enough to overrun the caller's deadline."""
        for n in range(len(rest)):
            self._wait(self.server.timeout_s / 4)
            self.wfile.write(rest[n : n + 1])

    def _wait(self, seconds: float) -> None:
        """Wait this long (s). Raise ConnectionError if the caller or the server closes the connection
        first."""
        end = time.monotonic() + seconds
        while (left_s := end - time.monotonic()) > 0:
            if select([self.connection], [], [], min(left_s, LOOK_S))[0]:
                raise ConnectionAbortedError("the caller has closed the connection")

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing, because the daemon's own log shows the requests."""


FAKE = Outside(serve)
