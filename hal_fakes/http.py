"""The far side of an `http` bus: a real HTTP server on 127.0.0.1 in front of charging stations.

`GET state_path` answers what the station does in the maker's numbers or words and fields; clearing,
start, stop and range check do what they are called. How the wire fails, by part and mode
(`hal_fakes.plants.plant.FAILURE_MODES`):

|         | off              | stuck           | slow               | garbage        | wrong         |
| server  | hangs up at once | the last answer | answers too late   | an HTML page   | state as text |
| headers | hangs up in them | stops in them   | one byte at a time | is no HTTP     | status 500    |
| body    | is empty         | stops in it     | one byte at a time | malformed JSON | unknown state |
"""

import contextlib
import json
import socket
import sys
import threading
import time
from collections.abc import Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from select import select
from types import MappingProxyType
from typing import Any, Final, cast

from bridges.charger.signals import Activity
from drivers.hal.http import base
from hal_fakes.plants.charger import ROBOTS_FAULTS, Reading
from hal_fakes.plants.plant import FailureMode, Plant
from hal_fakes.wiring import devices_on

LOOK_S: Final = 0.05
NEVER: Final = float("inf")
PAGE: Final = b"<!doctype html><title>Welcome</title>"
NEAREST: Final = {
    Activity.HANDSHAKE: Activity.IDLE,
    Activity.STOPPING: Activity.CHARGING,
    Activity.RELEASED: Activity.IDLE,
}
"""What a maker shows who has no number of its own for an activity."""


Failures = Mapping[str, FailureMode]
NONE: Final[Failures] = MappingProxyType({})


def serve(settings: Any, plants: Mapping[str, Plant], config: Any, bus_name: str) -> "HttpServer":
    """Serve the stations of this bus on a free port of 127.0.0.1."""
    stations = [
        Station(plants[name], device) for name, device in devices_on(config, bus_name).items()
    ]
    return HttpServer(stations, base(settings.api_base).path, settings.timeout_s)


class Station:
    """One plant with the numbers and paths of its maker."""

    def __init__(self, plant: Plant, settings: Any) -> None:
        self.plant = plant
        self.settings = settings
        self._lists: Mapping[Activity, list[int]] = settings.codes.lists()
        self._words = {code: word for word, code in settings.state_words.items()}
        self._last: bytes | None = None

    def reading(self) -> Reading:
        """What the station does now."""
        self.plant.advance(time.monotonic())
        return cast(Reading, self.plant.sense("reading"))

    def commands(self) -> dict[tuple[str, str], tuple[str, bool]]:
        """Method and path of each command -> what it does to the plant."""
        found = {("POST", self.settings.clear_error_path): ("clear_error", True)}
        does = {
            "start": ("power", True),
            "stop": ("power", False),
            "range_check": ("range_check", True),
        }
        for name, action in does.items():
            if call := getattr(self.settings, name):
                found[call.method, call.path] = action
        return found

    def obey(self, signal: str, asserted: bool) -> None:
        """Somebody has asked for it."""
        self.plant.drive(signal, asserted, time.monotonic())

    def body(self, reading: Reading) -> bytes:
        """The answer to `GET state_path`; wrong where the server is told to be."""
        server, body = reading.failures.get("server"), reading.failures.get("body")
        if server == "stuck" and self._last is not None:
            return self._last
        code: int | str = self._unknown() if body == "wrong" else self._code(reading)
        if server == "wrong":
            code = str(code)
        self._last = json.dumps(self._answer(code, reading)).encode()
        return {"off": b"", "garbage": self._last[:-9]}.get(body or "", self._last)

    def _answer(self, code: int | str, reading: Reading) -> dict[str, Any]:
        """Everything where the YAML says that it is."""
        fields, answer = self.settings.fields, dict[str, Any]()
        _put(answer, fields.state, self._words.get(code, code))
        _put(answer, fields.error_text, reading.error_text)
        if fields.receiver_id:
            _put(answer, fields.receiver_id, reading.receiver or None)
        if where := fields.in_range:
            yes = where.when[0] if where.when else True
            no = next(n for n in range(256) if n not in where.when) if where.when else False
            _put(answer, where.field, yes if reading.in_range else no)
        percent = None if reading.battery is None else 100 * reading.battery
        for name, value in (("battery_percent", percent), *_numbers(reading)):
            if number := getattr(fields, name):
                _put(answer, number.field, None if value is None else value / number.scale)
        return answer

    def _code(self, reading: Reading) -> int:
        if reading.error_text in ROBOTS_FAULTS and self.settings.codes.robot_error:
            return cast(int, self.settings.codes.robot_error[0])
        nearest = NEAREST.get(reading.activity, Activity.ERROR)
        codes = self._lists[reading.activity] or self._lists[nearest] or [self._unknown()]
        return codes[min(int(reading.progress * len(codes)), len(codes) - 1)]

    def _unknown(self) -> int:
        known = {code for codes in self._lists.values() for code in codes}
        return next(code for code in range(100, 65536) if code not in known)


def _numbers(reading: Reading) -> list[tuple[str, float | None]]:
    names = ("volts", "amps", "time_to_full_s")
    return [(name, getattr(reading, name)) for name in names]


def _put(answer: dict[str, Any], field: str, value: Any) -> None:
    """A value at its place; list items have no place here."""
    *above, last = field.split(".")
    for name in above:
        answer = answer.setdefault(name, {})
    answer[last] = value


class HttpServer:
    """The running server. `replace`: what must stand in the bus's settings instead.

    `path`: of the API. `timeout_s`: the client's deadline, which the slow failures overrun.
    """

    def __init__(self, stations: list[Station], path: str, timeout_s: float) -> None:
        self._server = _Listener(stations, path, timeout_s)
        host, port = self._server.server_address[:2]
        self.replace = {"api_base": f"{host!s}:{port}{path}"}
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(LOOK_S,), name="http", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Hang up on everybody. May be called twice."""
        self._server.shutdown()
        self._server.hang_up()
        self._server.server_close()
        self._thread.join()


class _Listener(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, stations: list[Station], path: str, timeout_s: float) -> None:
        self.get = {path + s.settings.state_path: s for s in stations}
        self.commands = {
            (method, path + below): (s, *does)
            for s in stations
            for (method, below), does in s.commands().items()
        }
        self.timeout_s = timeout_s
        self._callers: set[socket.socket] = set()
        self._lock = threading.Lock()
        super().__init__(("127.0.0.1", 0), _Call)

    def get_request(self) -> tuple[socket.socket, Any]:
        caller, address = super().get_request()
        with self._lock:
            self._callers.add(caller)
        return caller, address

    def shutdown_request(self, request: Any) -> None:
        with self._lock:
            self._callers.discard(request)
        super().shutdown_request(request)

    def hang_up(self) -> None:
        """End every conversation."""
        with self._lock:
            callers = list(self._callers)
        for caller in callers:
            with contextlib.suppress(OSError):
                caller.shutdown(socket.SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A caller that hung up is no news; anything else is a defect of this file."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Call(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    server: _Listener

    def do_GET(self) -> None:
        station = self.server.get.get(self.path)
        if station is None:
            self._answer(404, b"{}")
            return
        reading = station.reading()
        server = reading.failures.get("server")
        if server == "slow":
            self._wait(2 * self.server.timeout_s)
        if server == "garbage":
            self._answer(200, PAGE, reading.failures, "text/html")
            return
        self._answer(200, station.body(reading), reading.failures)

    def do_POST(self) -> None:
        self.rfile.read(int(self.headers.get("Content-Length", "0")))
        if (self.command, self.path) not in self.server.commands:
            self._answer(404, b"{}")
            return
        station, signal, asserted = self.server.commands[self.command, self.path]
        reading = station.reading()
        if reading.failures.get("server") is None:
            station.obey(signal, asserted)
        self._answer(200, b"{}", reading.failures)

    do_PUT = do_POST

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
        """Write an answer, as far as the wire lets it; True when the conversation is over.

        Head and body in one write: in two, each answer would take 40 ms (delayed ACK).
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
        """A byte now and then, so that the whole takes several times the caller's deadline."""
        for n in range(len(rest)):
            self._wait(self.server.timeout_s / 4)
            self.wfile.write(rest[n : n + 1])

    def _wait(self, seconds: float) -> None:
        """Until then, or until the caller hangs up or the server closes (ConnectionError)."""
        end = time.monotonic() + seconds
        while (left_s := end - time.monotonic()) > 0:
            if select([self.connection], [], [], min(left_s, LOOK_S))[0]:
                raise ConnectionAbortedError("the caller has hung up")

    def log_message(self, format: str, *args: Any) -> None:
        """Who calls is the daemon's log's business."""
