"""Who may look at the page, and how many browsers at once."""

from typing import Final
from urllib.parse import quote

from fastapi.requests import HTTPConnection
from nicegui import Client

from workbench.page.guard import Refusal, Scope
from workbench.page.login import Login

MOST_BROWSERS: Final = 50
"""The most views at once; each takes up to a megabyte. An unused view is dropped within a minute."""
OF_EVERYBODY: Final = ("/login", "/favicon.ico")
LIBRARY: Final = "/_nicegui/"
"""The library's own scripts and styles."""
SOCKET: Final = "/_nicegui_ws/"


class Gate:
    """Lets requests in. `closed`: only those of logged-in users."""

    def __init__(self, login: Login, *, closed: bool) -> None:
        self._login = login
        self._closed = closed

    def __call__(self, scope: Scope) -> Refusal | None:
        """Why a request is not answered; None if it is."""
        path = str(scope["path"])
        if path in OF_EVERYBODY or path.startswith(LIBRARY):
            return None
        if self._closed and not self._login.user(HTTPConnection(scope)):
            return Refusal(303, "log in first", f"/login?next={quote(path)}")
        if not path.startswith(SOCKET) and len(Client.instances) >= MOST_BROWSERS:
            return Refusal(503, "too many browsers have this page open; try again in a minute")
        return None
