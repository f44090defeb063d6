"""Identify the user of a request. The user's name comes from the cookie of a login session, or from the
header of a trusted proxy.

A session's cookie is HttpOnly and SameSite=Strict. If the form came over TLS, the cookie is also
Secure. Besides the cookie, each form contains a secret value (`proof`), against forged forms. The
header of a reverse proxy counts only if the request comes from the proxy's address. A tab keeps the
request that loaded it. So a proxy's header counts only as long as a session would.
"""

import asyncio
import time
from html import escape
from pathlib import Path
from typing import Final
from urllib.parse import parse_qs, quote

from fastapi import Request, Response
from fastapi.requests import HTTPConnection
from fastapi.responses import HTMLResponse, RedirectResponse

from bridges.messages.words import printable
from workbench.page.access import LoginSession, LoginSessions, PasswordCheck

COOKIE: Final = "rmf_bridge_page"
PROXIED: Final = "rmf_bridge_page"
"""Key in the scope of a proxy's request, for the session that began with the request."""
STYLE: Final = (Path(__file__).parent / "style.css").read_text(encoding="utf-8")
SCRIPT: Final = (Path(__file__).parent / "page.js").read_text(encoding="utf-8")
FORM: Final = """<!doctype html><html lang="en"><head><meta charset="utf-8">
<title>Log in · RMF bridges</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head><body>
<main id="main"><form class="login panel" method="post" action="/login?next={next}"><h1>Log in</h1>
<p class="alert" role="alert">{why}</p>
<label for="user">User</label><input id="user" name="user" autocomplete="username" required autofocus>
<label for="password">Password</label>
<input id="password" name="password" type="password" autocomplete="current-password" required>
<button>Log in</button></form></main></body></html>"""


class Login:
    """The logins of users. Without a password file and without a proxy, nobody can log in or act."""

    def __init__(self, door: PasswordCheck | None, *, proxy: str = "", header: str = "") -> None:
        """Begin without sessions. `proxy` is the proxy's address. `header` is the proxy's header that
        names the user."""
        self._door = door
        self._proxy = proxy
        self._header = header
        self._sessions = LoginSessions()
        self._one_at_a_time = asyncio.Lock()

    def user(self, request: HTTPConnection) -> str:
        """Return the user. Return "" without a login, or after the login's end."""
        now = time.monotonic()
        if self._proxy and request.client and request.client.host == self._proxy:
            user = printable(request.headers.get(self._header, ""))[:64]
            began = request.scope.setdefault(PROXIED, LoginSession(user, now, now, ""))
            return user if began.use(now) else ""
        session = self._sessions.find(request.cookies.get(COOKIE), now)
        return session.user if session else ""

    def form(self, request: Request, user: str) -> str:
        """Return the HTML for a page's head. The HTML shows the user, or a link to the login."""
        session = self._sessions.find(request.cookies.get(COOKIE), time.monotonic())
        if user and session:
            return (
                f'<form class="who" method="post" action="/logout">{escape(user)}'
                f'<input type="hidden" name="proof" value="{escape(session.proof)}">'
                "<button>Log out</button></form>"
            )
        if user:
            return f'<p class="who">{escape(user)}</p>'
        if self._door is None:
            return ""
        return f'<p class="who"><a href="/login?next={quote(request.url.path)}">Log in</a></p>'

    def show(self, request: Request) -> HTMLResponse:
        """Show the login form."""
        return self._page(request)

    def _page(self, request: Request, why: str = "", status: int = 200) -> HTMLResponse:
        if self._door is None:
            why = "This page was started without a password file, so nobody can log in."
        html = FORM.format(style=STYLE, why=escape(why), next=quote(_next(request)))
        return HTMLResponse(html, status_code=status)

    async def log_in(self, request: Request) -> Response:
        """Check the user and the password, and begin a session."""
        fields = await _fields(request)
        user, password = fields.get("user", ""), fields.get("password", "")
        address = request.client.host if request.client else ""
        if self._door is None:
            return self._page(request, status=403)
        async with self._one_at_a_time:  # each check takes 16 MB and 50 ms
            why = await asyncio.to_thread(
                self._door.refuses, user, password, address, time.monotonic()
            )
        if why:
            return self._page(request, why, status=403)
        answer = RedirectResponse(_next(request), status_code=303)
        self._sessions.end(request.cookies.get(COOKIE))
        answer.set_cookie(
            COOKIE,
            self._sessions.begin(user, time.monotonic()),
            httponly=True,
            samesite="strict",
            secure=request.headers.get("origin", "").startswith("https://"),
        )
        return answer

    async def log_out(self, request: Request) -> Response:
        """End the session, if the form has the session's proof."""
        secret = request.cookies.get(COOKIE)
        session = self._sessions.find(secret, time.monotonic())
        fields = await _fields(request)
        if session is None or fields.get("proof") != session.proof:
            return HTMLResponse("this form is too old", status_code=403)
        self._sessions.end(secret)
        answer = RedirectResponse("/", status_code=303)
        answer.delete_cookie(COOKIE)
        return answer


async def _fields(request: Request) -> dict[str, str]:
    """Return a form's fields. Return {} for a form with too many fields."""
    try:
        found = parse_qs((await request.body()).decode(errors="replace"), max_num_fields=10)
    except ValueError:
        return {}
    return {name: values[0] for name, values in found.items()}


def _next(request: Request) -> str:
    """Return the address to show next. The address must be a path of this page."""
    path = request.query_params.get("next", "/")
    plain = path.startswith("/") and not path.startswith(("//", "/\\")) and path.isprintable()
    return path if plain else "/"
