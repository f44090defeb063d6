"""Ends connections that only take: a browser that does not read, and a socket that asks for nothing."""

import asyncio
import logging
import time
from collections.abc import Hashable, Iterable
from contextlib import suppress
from typing import Final

from nicegui import core
from nicegui.server import Server

from bridges.log import pairs

log = logging.getLogger(__name__)

LOOK_S: Final = 1.0
MOST_WAITING: Final = 50
"""Packets for a browser that does not read them: five seconds. A browser that reads has a few."""
MOST_SILENT_S: Final = 10.0
"""Until the first request has come whole. The library itself waits for ever."""


class Waiting:
    """Since when each of them waits."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def too_long(self, there: Iterable[Hashable], now: float) -> list[Hashable]:
        """Those of `there` that have waited for more than MOST_SILENT_S. Others are forgotten."""
        self._since = {one: self._since.get(one, now) for one in there}
        return [one for one, since in self._since.items() if now - since > MOST_SILENT_S]


async def watch() -> None:
    """For ever."""
    silent = Waiting()
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
