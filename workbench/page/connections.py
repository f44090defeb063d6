"""Ends useless connections: a browser that does not read, and a socket that sends no request."""

import asyncio
import logging
import time
from collections.abc import Hashable, Iterable, Iterator
from contextlib import suppress
from typing import Any, Final

from nicegui import core
from nicegui.server import Server

from bridges.host.log import pairs
from bridges.kinds.shared.durations import AGES_AGO
from workbench.page.silent import Silent

log = logging.getLogger(__name__)

LOOK_S: Final = 1.0
QUIET_S: Final = 60.0
"""It is said so often at most."""
MOST_WAITING: Final = 50
"""The most unread packets of a browser: about five seconds of them. A browser that reads has a few."""


async def watch() -> None:
    """For ever."""
    silent = Silent()
    ended: set[object] = set()
    told_at = AGES_AGO
    while True:
        await asyncio.sleep(LOOK_S)
        told_at = await _end_deaf(ended, told_at)
        unasked = dict(_unasked(Server.instance.server_state.connections))
        for one in silent.too_long(unasked, time.monotonic()):
            unasked[one].transport.close()


def _unasked(connections: Iterable[Any]) -> Iterator[tuple[Hashable, Any]]:
    """The connections on which no request is being answered, each under its last request."""
    for one in connections:
        last = getattr(one, "cycle", one)
        if last is None or getattr(last, "response_complete", False):
            yield (one, last), one


async def _end_deaf(ended: set[object], told_at: float) -> float:
    """`ended`: which were ended before, and may take a while to go. Returns when it was said last."""
    sockets = core.sio.eio.sockets.copy()
    ended &= sockets.keys()
    deaf = [one for one in sockets.keys() - ended if sockets[one].queue.qsize() > MOST_WAITING]
    for one in deaf:
        ended.add(one)
        with suppress(Exception):  # it may be closing already
            await sockets[one].close(wait=False)
    now = time.monotonic()
    if not deaf or now < told_at + QUIET_S:
        return told_at
    log.warning(pairs("browser_does_not_read", browsers=len(deaf)))
    return now
