"""The page's application: the views' addresses, who may open the page, and the serving process.

Only this module and the views import NiceGUI. A browser's action reaches the graph only through a
command (`actions.py`).
"""

import argparse
import asyncio
import ipaddress
import logging
import os
import socket
import sys
import time
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from fastapi.requests import HTTPConnection
from nicegui import Client, app, core, ui
from nicegui.server import Server
from starlette.types import Scope

from bridges.kinds.shared.durations import AGES_AGO
from bridges.system.log import pairs
from bridges.transports.transport import Transport
from workbench.graph.join import interruptible
from workbench.page.access import PasswordCheck
from workbench.page.actions import Deeds
from workbench.page.cards import Cards
from workbench.page.day_views import DayViews
from workbench.page.guard import HttpRefusal, RequestGuard
from workbench.page.idle_connections import Silent
from workbench.page.incident_views import IncidentViews
from workbench.page.listener import Listener
from workbench.page.live_site import LiveSite
from workbench.page.local_daemons import LocalDaemons
from workbench.page.login import SCRIPT, STYLE, Login
from workbench.page.site_views import SiteViews

log = logging.getLogger(__name__)

PUMP_S: Final = 0.1
HERE_S: Final = 1.0
RECONNECT_S: Final = 30.0
"""Maximum time (s) for which a browser may be disconnected. After a longer time, the browser reloads
its view."""
MOST_HISTORY: Final = 100
"""Maximum number of missed updates that a returning browser gets. After more missed updates, the
browser reloads its view."""
MOST_CONNECTIONS: Final = 200
MOST_BYTES: Final = 64 * 1024
"""Maximum size (bytes) of a message from a browser. The library's own messages are a hundred times
smaller."""
MOST_BROWSERS: Final = 50
"""Maximum number of open views. Each view takes up to a megabyte. The page drops an unused view within
a minute."""
OF_EVERYBODY: Final = ("/login", "/favicon.ico")
LIBRARY: Final = "/_nicegui/"
"""Path of the library's own scripts and styles."""
SOCKET: Final = "/_nicegui_ws/"
LOOK_S: Final = 1.0
QUIET_S: Final = 60.0
"""Minimum time (s) between log lines about browsers that do not read."""
MOST_WAITING: Final = 50
"""Maximum number of packets that a browser has not read yet. A browser that does not read gets so many
packets in about five seconds. A browser that reads never has so many."""


class Gate:
    """Admission of up to MOST_BROWSERS browsers. If `closed` is true, only logged-in users are
    admitted."""

    def __init__(self, login: Login, *, closed: bool) -> None:
        self._login = login
        self._closed = closed

    def __call__(self, scope: Scope) -> HttpRefusal | None:
        """Return the reason to refuse a request. Return None for an accepted request."""
        path = str(scope["path"])
        if path in OF_EVERYBODY or path.startswith(LIBRARY):
            return None
        if self._closed and not self._login.user(HTTPConnection(scope)):
            return HttpRefusal(303, "log in first", f"/login?next={quote(path)}")
        if not path.startswith(SOCKET) and len(Client.instances) >= MOST_BROWSERS:
            return HttpRefusal(503, "too many browsers have this page open; try again in a minute")
        return None


def serve(
    args: argparse.Namespace,
    opened: socket.socket,
    known: Mapping[str, str],
    join: Callable[[], Transport],
    graph: Sequence[str],
) -> None:
    """Serve until a signal ends the process.

    - `opened`: a socket that listens at `args.listen`.
    - `known`: user -> password hash.
    - `graph`: the options that name the page's graph, for the page's commands.
    """
    address, _ = args.listen
    shown = f"[{address}]" if ":" in address else address
    netloc = f"{shown}:{opened.getsockname()[1]}"
    login = Login(
        PasswordCheck(known) if known else None, proxy=args.proxy or "", header=args.proxy_header
    )
    ui.add_css(STYLE, shared=True)
    ui.add_head_html(f"<script>{SCRIPT}</script>", shared=True)
    # Otherwise Quasar draws a progress bar during each request of a script. That bar has no name for
    # screen readers.
    app.config.quasar_config["loadingBar"]["skipHijack"] = True
    app.get("/login")(login.show)
    app.post("/login")(login.log_in)
    app.post("/logout")(login.log_out)
    IncidentViews(args.incidents, args.recording, login).install()
    DayViews(args.incidents, login).install()
    listener = None
    if args.recording is None:
        listener = _live(args, join, login, graph)
    gate = Gate(login, closed=not ipaddress.ip_address(address).is_loopback)
    app.add_middleware(RequestGuard, hosts=_hosts(address, netloc, args.host), gate=gate)
    for name in ("engineio.server", "socketio.server"):
        logging.getLogger(name).handlers.clear()  # they log each malformed frame
    app.on_startup(lambda: _end_useless())
    app.on_startup(lambda: _say(f"the page is at http://{netloc}/ (Ctrl-C ends it)"))
    try:
        with interruptible(), suppress(KeyboardInterrupt):
            ui.run(
                reload=False,
                show=False,
                fd=opened.fileno(),
                show_welcome_message=False,
                proxy_headers=False,
                server_header=False,
                title="RMF bridges",
                tailwind=False,
                reconnect_timeout=RECONNECT_S,
                message_history_length=MOST_HISTORY,
                limit_concurrency=MOST_CONNECTIONS,
                ws_max_size=MOST_BYTES,
                log_config=None,  # our own log formats the server's lines
                language="en-GB",
            )
    finally:
        if listener is not None:
            listener.end()


def _live(
    args: argparse.Namespace,
    join: Callable[[], Transport],
    login: Login,
    graph: Sequence[str],
) -> Listener:
    site = LiveSite(graph)
    listener = Listener(site, join)
    cards = Cards(site, listener)
    here = LocalDaemons(args.runtime_dirs, site.reporters, lambda: listener.domain_id)
    state = os.environ.get("STATE_DIRECTORY")
    deeds = Deeds(Path(state) if state else None)
    SiteViews(site, cards, here, login, deeds, graph).install()
    app.on_startup(lambda: _pump(cards))
    app.on_startup(lambda: _look(here))
    listener.start()
    return listener


async def _pump(cards: Cards) -> None:
    while True:
        await asyncio.sleep(PUMP_S)
        try:
            cards.turn()
        except Exception:  # an error in one card must not stop the page
            log.exception("page")


async def _look(here: LocalDaemons) -> None:
    """Look for this machine's daemons in the background, so that `_pump` does not wait."""
    while True:
        with suppress(OSError):
            await asyncio.to_thread(here.look)
        await asyncio.sleep(HERE_S)


async def _end_useless() -> None:
    """Close connections if the browser does not read, or sends no request. Run until the page ends."""
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
    """Yield the connections that are idle, because no request is being answered. Each connection comes
    with its last request."""
    for one in connections:
        last = getattr(one, "cycle", one)
        if last is None or getattr(last, "response_complete", False):
            yield (one, last), one


async def _end_deaf(ended: set[object], told_at: float) -> float:
    """Disconnect browsers that do not read. Return the time of the last log line.

    `ended` has the browsers that are already being disconnected.
    """
    sockets = core.sio.eio.sockets.copy()
    ended &= sockets.keys()
    deaf = [one for one in sockets.keys() - ended if sockets[one].queue.qsize() > MOST_WAITING]
    for one in deaf:
        ended.add(one)
        with suppress(Exception):  # the socket may be closing already
            await sockets[one].close(wait=False)
    now = time.monotonic()
    if not deaf or now < told_at + QUIET_S:
        return told_at
    log.warning(pairs("browser_does_not_read", browsers=len(deaf)))
    return now


def _hosts(address: str, netloc: str, names: Sequence[str]) -> set[str]:
    port = netloc.rpartition(":")[2]
    loopback = ipaddress.ip_address(address).is_loopback
    return {netloc, *names, *((f"localhost:{port}",) if loopback else ())}


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()
