"""Ends useless connections: a browser that does not read, and a socket that sends no request."""

import asyncio
import logging
import time
from collections.abc import Hashable, Iterable, Iterator
from contextlib import suppress
from typing import Any, Final

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
        unasked = dict(_unasked(Server.instance.server_state.connections))
        for one in silent.too_long(unasked, time.monotonic()):
            unasked[one].transport.close()


def _unasked(connections: Iterable[Any]) -> Iterator[tuple[Hashable, Any]]:
    """The connections on which no request is being answered, each under its last request."""
    for one in connections:
        last = getattr(one, "cycle", one)
        if last is None or getattr(last, "response_complete", False):
            yield (one, last), one


async def _end_deaf() -> None:
    for socket in list(core.sio.eio.sockets.values()):
        waiting = socket.queue.qsize()
        if waiting > MOST_WAITING:
            log.warning(pairs("browser_does_not_read", waiting=waiting))
            with suppress(Exception):  # it may be closing already
                await socket.close(wait=False)
