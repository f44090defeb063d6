"""A controller's WebSocket, through the library websockets. After each message the daemon reads the
controller at once.

The daemon ignores the content of a message, because a message does not show its age, and many makes
push only the part that has changed. So a WebSocket that is silent, late, garbled or gone cannot make a
reading wrong. Without messages the daemon reads the controller every `scan_s`, and once after each new
connection.
"""

import logging
import threading
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

from bridges.system.log import pairs
from drivers.hal import HalError
from drivers.hal.backoff import BACKOFF_FIRST_S, BACKOFF_MAX_S
from drivers.hal.http_json import excerpt

AT_MOST_EVERY_S: Final = 0.1
"""The shortest time (s) between two readings, if messages cause them."""
MESSAGE_MAX: Final = 64 * 1024
OPEN_S: Final = 3.0
CLOSE_S: Final = 0.2

if TYPE_CHECKING:
    from websockets.sync.client import ClientConnection

log = logging.getLogger(__name__)
logging.getLogger("websockets.client").setLevel(logging.CRITICAL)  # `push_lost` reports it


class Pushes:
    """A thread that listens to a WebSocket until `close`.

    For each connection the thread calls `headers`, which returns the headers of the handshake. The
    thread calls `wake` after each connection and for messages. A connection without a message counts as
    failed, because a server may accept each connection and close it at once.
    """

    def __init__(
        self,
        url: str,
        headers: Callable[[], Mapping[str, str]],
        ca_file: str | None,
        wake: Callable[[], None],
    ) -> None:
        self._url = f"ws{url.removeprefix('http')}"
        self._headers = headers
        self._ca_file = ca_file
        self._wake = wake
        self._ended = threading.Event()
        self._connection: ClientConnection | None = None
        self._works = False
        self._thread = threading.Thread(target=self._run, name="http push", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread. The caller may call `close` twice."""
        self._ended.set()
        if self._connection:
            self._connection.close()
        self._thread.join(OPEN_S)

    def _run(self) -> None:
        pause_s, told = BACKOFF_FIRST_S, False
        while not self._ended.is_set():
            self._works = False
            trouble = self._listened()
            if self._works:
                pause_s, told = BACKOFF_FIRST_S, False
            if not told and not self._ended.is_set():
                log.warning(pairs("push_lost", url=self._url, reason=trouble))
            told = True
            self._ended.wait(pause_s)
            pause_s = min(2 * pause_s, BACKOFF_MAX_S)

    def _listened(self) -> str:
        """Listen on one connection until it ends. Return the reason for its end."""
        try:
            from websockets.exceptions import WebSocketException
        except ImportError:
            return "websockets is not installed: pip install 'rmf-bridges[push]'"
        try:
            with self._connected() as self._connection:
                self._wake()
                while not self._ended.is_set():
                    self._connection.recv(decode=False)
                    if not self._works:
                        log.info(pairs("push_works", url=self._url))
                    self._works = True
                    self._wake()
                    self._ended.wait(AT_MOST_EVERY_S)
        except (OSError, WebSocketException, HalError) as error:
            return excerpt(str(error) or type(error).__name__)
        return "ended"

    def _connected(self) -> "ClientConnection":
        import ssl

        from websockets.sync.client import connect

        tls = self._url.startswith("wss:")
        return connect(
            self._url,
            ssl=ssl.create_default_context(cafile=self._ca_file) if tls else None,
            additional_headers=self._headers(),
            proxy=None,
            compression=None,
            user_agent_header="rmf-bridges",
            open_timeout=OPEN_S,
            close_timeout=CLOSE_S,
            max_size=MESSAGE_MAX,
        )
