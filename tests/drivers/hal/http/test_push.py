"""A controller's WebSocket.

A message on the WebSocket wakes the daemon. No failure of the WebSocket makes a reading wrong.
"""

import base64
import hashlib
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import msgspec
import pytest
from websockets.sync import client
from websockets.sync.client import connect
from websockets.sync.server import ServerConnection, serve

from drivers.hal import http
from drivers.hal.http_push import MESSAGE_MAX
from drivers.lift.http import HttpLiftSettings, create
from hal_fakes.http import HttpServer
from hal_fakes.http_lift import FakeHttpLift, build
from hal_fakes.realtime import RealTime
from tests.drivers.hal.http.far_end import Caller, FarEnd, always, answer, once
from tests.drivers.lift.contract import QUICK
from tests.drivers.lift.test_http import settings_of
from tests.waiting import PATIENCE_S, wait_until


class Wakes:
    """A thread-safe counter of calls."""

    def __init__(self) -> None:
        self.count = 0
        self._lock = threading.Lock()

    def __call__(self) -> None:
        with self._lock:
            self.count += 1

    def more_than(self, before: int) -> None:
        wait_until(lambda: self.count > before, f"woken more than {before} times")


@contextmanager
def listening(port: int, **more: Any) -> Iterator[tuple[http.HttpBus, Wakes]]:
    plain = {"type": "http", "api_base": f"127.0.0.1:{port}", "push_path": "/ws", **more}
    bus, wakes = http.HttpBus(msgspec.convert(plain, http.HttpSettings)), Wakes()
    bus.on_edge(wakes)
    try:
        yield bus, wakes
    finally:
        bus.close()
        bus.close()


@contextmanager
def pushing(
    talk: Callable[[ServerConnection], None], port: int = 0
) -> Iterator[tuple[int, list[str]]]:
    """Yield a server's port and the Authorization headers that the server has received.

    The server runs `talk` on every connection.
    """
    asked: list[str] = []

    def handle(connection: ServerConnection) -> None:
        assert connection.request is not None
        asked.append(connection.request.headers.get("Authorization", ""))
        talk(connection)

    with serve(handle, "127.0.0.1", port, compression=None) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        yield server.socket.getsockname()[1], asked
        server.shutdown()
        thread.join()


def test_a_message_wakes_the_daemon_and_the_state_is_read_by_a_request() -> None:
    settings: HttpLiftSettings = settings_of()
    world = RealTime({"lift": build("lift", settings, QUICK)})
    plant = world.plants["lift"]
    server = HttpServer([FakeHttpLift(plant, settings)], "", 0.5, "/ws")
    with listening(server.replace["api_base"].rpartition(":")[2]) as (bus, wakes):  # type: ignore[attr-defined]
        wakes.more_than(1)  # one wake for the connection, and one for the state
        lift = create("lift", settings, bus)
        assert not lift.read().hazards
        before = wakes.count
        plant.press("fire_alarm", True, 0.0)
        wakes.more_than(before)
        assert lift.read().hazards == {"fire_alarm"}
    server.close()
    world.close()


def test_the_simulated_gateway_answers_a_ping() -> None:
    server = HttpServer([], "", 0.5, "/ws")
    with connect(f"ws://{server.replace['api_base']}/ws", proxy=None) as connection:
        assert connection.ping().wait(PATIENCE_S)
    server.close()


def test_without_a_push_path_there_is_no_thread() -> None:
    before = threading.active_count()
    bus = http.HttpBus(http.HttpSettings(api_base="127.0.0.1:1"))
    bus.on_edge(lambda: None)
    assert threading.active_count() == before
    bus.close()


def ends(connection: ServerConnection) -> None:
    connection.send("{}")


def too_long(connection: ServerConnection) -> None:
    connection.send("x" * (MESSAGE_MAX + 1))
    connection.recv()


def silent(connection: ServerConnection) -> None:
    connection.recv()


@pytest.mark.parametrize("talk", [ends, too_long], ids=lambda talk: talk.__name__)
def test_a_websocket_that_ends_is_opened_again_and_each_opening_wakes(
    talk: Callable[[ServerConnection], None],
) -> None:
    with pushing(talk) as (port, asked), listening(port) as (_, wakes):
        wait_until(lambda: len(asked) > 1, "it connects again")
        wakes.more_than(1)


def closes(connection: ServerConnection) -> None:
    connection.close()


def test_a_server_that_closes_each_websocket_at_once_is_logged_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with pushing(closes) as (port, asked), listening(port):
        wait_until(lambda: len(asked) > 2, "it connects again")
    assert len([r for r in caplog.records if "push_" in r.message]) == 1


def test_closing_a_silent_websocket_waits_for_nothing() -> None:
    with pushing(silent) as (port, asked), listening(port) as (_, wakes):
        wakes.more_than(0)
    assert (wakes.count, len(asked)) == (1, 1)


@pytest.mark.parametrize(
    "talk",
    [
        once(answer(b"{}", "404 Not Found")),
        once(b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n\r\n"),
        once(b"\x00" * 5000),
        once(b""),
        always(answer()),
    ],
)
def test_a_server_that_speaks_no_websocket_wakes_nobody_and_is_logged_once(
    talk: Any, caplog: pytest.LogCaptureFixture
) -> None:
    with FarEnd(talk) as far, listening(far.port) as (_, wakes):
        wait_until(lambda: far.connections > 1, "it tries again")
    assert wakes.count == 0
    assert len([r for r in caplog.records if "push_lost" in r.message]) == 1


def deaf(caller: Caller) -> None:
    """Accept the WebSocket (RFC 6455, 4.2.2), and answer no ping."""
    lines = dict(line.split(b": ", 1) for line in caller.request().split(b"\r\n")[1:-2])
    guid = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
    accept = base64.b64encode(hashlib.sha1(lines[b"Sec-WebSocket-Key"] + guid).digest())
    caller.send(
        b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Accept: " + accept + b"\r\n\r\n"
    )
    caller.request()  # returns when the daemon hangs up


def test_a_server_that_answers_no_ping_is_logged_once_in_our_form(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    soon = partial(client.connect, ping_interval=0.05, ping_timeout=0.05)
    monkeypatch.setattr(client, "connect", soon)
    with FarEnd(deaf) as far, listening(far.port):
        wait_until(lambda: far.connections > 1, "it connects again")
    reason = "sent 1011 (internal error) keepalive ping timeout; no close frame received"
    url = f"ws://127.0.0.1:{far.port}/ws"
    assert [r.getMessage() for r in caplog.records] == [f'push_lost url={url} reason="{reason}"']


def test_a_flood_of_messages_is_read_at_a_bounded_pace() -> None:
    sent, stop = Wakes(), threading.Event()

    def flood(connection: ServerConnection) -> None:
        while not stop.is_set():
            connection.send(json.dumps({"n": sent.count}))
            sent()

    with pushing(flood) as (port, _), listening(port) as (_, wakes):
        wakes.more_than(3)
        wait_until(lambda: sent.count > 20 * wakes.count, "most messages wake nobody")
        stop.set()


def test_a_token_opens_the_websocket_too(tmp_path: Any) -> None:
    file = tmp_path / "token"
    file.touch(mode=0o600)
    file.write_text("t0ken")
    with pushing(silent) as (port, asked), listening(port, token_file=str(file)):
        wait_until(lambda: bool(asked), "the server has been asked")
        assert asked == ["Bearer t0ken"]
