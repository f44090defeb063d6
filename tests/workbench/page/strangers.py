"""Hostile input for the page: unfinished requests, strange frames, and long names on its graph."""

import random
import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Final
from urllib.parse import urlsplit

from websockets import Origin
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.cdr import LONGEST_FLAT
from bridges.transports.transport import Transport
from tests.workbench.page.browser.test_safety import ask

SOCKET: Final = "_nicegui_ws/socket.io/?EIO=4&transport="
FRAMES: Final = (
    *("", "4", "42", "42[]", '42["event"]', '42["event",1]', '42["event",{}]', '42["handshake"]'),
    *('42["handshake",{}]', '42["log",{}]', '42["ack",{}]', '42["ack",{"client_id":"x"}]', "43"),
    *('42["event",{"client_id":"%s","id":"x","args":7}]', '42["handshake",{"client_id":"%s"}]'),
    *('42["javascript_response",{"client_id":"%s"}]', "42[{}]", "42[[],[]]", "42null", "4999"),
    *('451-["x",{"_placeholder":true,"num":9}]', "41", "2", "3", "5", "6", "1", "0", "x", "\0"),
    *('42["log",{"client_id":"%s","level":"error","message":"\\u001b[2J"}]', "42" + "[" * 900),
    *(b"", b"\xff\xfe", b"\0" * 100),
)
MB: Final = 1_000_000


@contextmanager
def half_requests(address: str, number: int, *, body: bool) -> Iterator[None]:
    """Open `number` connections, and leave a request unfinished on each connection.

    With `body` each connection sends half a form. Otherwise each connection sends a complete request,
    and then half of the next head.
    """
    place = urlsplit(address)
    there, host = (place.hostname or "", place.port or 0), f"Host: {place.netloc}\r\n"
    first = f"GET /favicon.ico HTTP/1.1\r\n{host}\r\nGET / HTTP/1.1\r\n"
    if body:
        first = f"POST /login HTTP/1.1\r\n{host}Content-Length: 1000\r\n\r\nuser="
    with ExitStack() as opened:
        for _ in range(number):
            opened.enter_context(socket.create_connection(there)).sendall(first.encode())
        yield


def client_of(address: str) -> str:
    """Return the client id that the page gives to a view's script."""
    found = re.search(r"'client_id': '([0-9a-f-]+)'", ask(address, "/")[2])
    assert found
    return found[1]


def strange_frames(address: str, rng: random.Random, number: int) -> int:
    """Send frames that no browser would send, each on a new socket. Return the number of sent
    frames."""
    client, sent = client_of(address), 0
    where = f"{address.replace('http', 'ws', 1)}{SOCKET}websocket"
    view = f"&client_id={client}&next_message_id=0&implicit_handshake=true&document_id=d&tab_id=t"
    for n in range(number):
        frame = FRAMES[n % len(FRAMES)]
        whose = rng.choice((view, view, "", "&client_id=x", view.replace("id=0", "id=x")))
        with (
            suppress(WebSocketException, OSError, EOFError),
            connect(where + whose, origin=Origin(address.rstrip("/")), close_timeout=0) as joined,
        ):
            if rng.random() < 0.8:
                joined.send("40")
            joined.send(frame.replace("%s", client) if isinstance(frame, str) else frame)
            sent += 1
            with suppress(TimeoutError):
                joined.recv(0.01)
    return sent


def long_names(
    transport: Transport, times: int = 1, length: int = LONGEST_FLAT - 1000
) -> Iterator[None]:
    """Publish 23 lifts with long names in each of `times` rounds. Yield after each round.

    The names have `length` characters. The default is about the longest name that a transport permits.
    """
    publisher = transport.publisher(topics.LIFT_STATES)
    for n in range(times):
        for lift in range(23):
            name = f"{lift:02}" + "x" * length
            publisher.publish(d.LiftState(lift_name=name, session_id=f"robot_{n}"))
        yield
