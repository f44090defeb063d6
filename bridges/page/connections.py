"""Ends useless connections: a browser that does not read, and a socket that sends no request."""

import asyncio
import logging
import time
from contextlib import suppress
from typing import Final

from nicegui import core
from nicegui.server import Server

from bridges.log import pairs
from bridges.page.silent import Silent

log = logging.getLogger(__name__)

LOOK_S: Final = 1.0
MOST_WAITING: Final = 50
"""The most unread packets of a browser: about five seconds of them. A browser that reads has a few."""


async def watch() -> None:
    """For ever."""
    silent = Silent()
    while True:
        await asyncio.sleep(LOOK_S)
        await _end_deaf()
        state = Server.instance.server_state
        unasked = [one for one in state.connections if getattr(one, "cycle", one) is None]
        for connection in silent.too_long(unasked, time.monotonic()):
            connection.transport.close()  # type: ignore[attr-defined]


async def _end_deaf() -> None:
    for socket in list(core.sio.eio.sockets.values()):
        waiting = socket.queue.qsize()
        if waiting > MOST_WAITING:
            log.warning(pairs("browser_does_not_read", waiting=waiting))
            with suppress(Exception):  # it may be closing already
                await socket.close(wait=False)
