"""Guard the page. The guard checks each request before the page sees the request.

The guard checks the Host, the Origin and the login. The guard also limits a request's time and size.

Without a guard, a web site that is open in the same browser could reach a page on 127.0.0.1. The site
could use a name that resolves to 127.0.0.1 (DNS rebinding), or its own socket or form. Therefore the
guard accepts only the page's configured names. Only the page's own origin may open the socket or post a
form.
"""

import asyncio
import ipaddress
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MOST_BODY: Final = 64 * 1024
BODY_S: Final = 5.0
"""Maximum time (s) for a request to arrive."""
ANSWER_S: Final = 120.0
"""Maximum time (s) to send an answer. This time is enough for 15 MB at 1 Mbit/s."""
HEADERS: Final = {
    "content-security-policy": "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval';"
    " style-src 'self' 'unsafe-inline'; img-src 'self' data:; font-src 'self' data:;"
    " connect-src 'self'; frame-ancestors 'none'; base-uri 'self'; form-action 'self'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",
}
"""Security headers of every answer. NiceGUI needs inline scripts and evaluated scripts. All scripts,
styles and images come from the page's own address."""


@dataclass(frozen=True, slots=True)
class HttpRefusal:
    """Reason to refuse a request. `to` is the address of a redirection, if there is one."""

    status: int
    why: str
    to: str = ""


def refused(scope: Scope, hosts: Collection[str]) -> str:
    """Return the reason to refuse this request. Return "" for an accepted request. `hosts` has the
    page's names, with or without a port.

    If the request names the host by an IP address, it is accepted. An attacker can make a name lead to
    another machine, but not an address.
    """
    headers = Headers(scope=scope)
    host = headers.get("host", "").lower()
    if not _is_address(host) and not any(
        host in (known, host_of(known)) or host_of(host) == known for known in hosts
    ):
        return "this page does not serve that host name"
    origin = headers.get("origin")
    changes = scope["type"] == "websocket" or scope.get("method") not in ("GET", "HEAD", "OPTIONS")
    if origin is None:
        return "no origin" if scope["type"] == "websocket" else ""
    if changes and origin.lower().partition("://")[2] != host:
        return "that is for this page's own origin only"
    return ""


def host_of(netloc: str) -> str:
    """Return the host without its port, such as `[::1]` for `[::1]:8080`."""
    name, colon, port = netloc.rpartition(":")
    return name if colon and port.isdecimal() else netloc


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host_of(host).strip("[]"))
    except ValueError:
        return False
    return True


class RequestGuard:
    """The outermost layer of the page's server, which checks each request first.

    `gate` checks each request whose Host and Origin are right once more.
    """

    def __init__(
        self, app: ASGIApp, hosts: Iterable[str], gate: Callable[[Scope], HttpRefusal | None]
    ) -> None:
        self._app = app
        self._hosts = frozenset(host.lower() for host in hosts)
        self._gate = gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handle a connection (ASGI)."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        why = refused(scope, self._hosts)
        refusal = HttpRefusal(403, why) if why else self._gate(scope)
        if refusal is None and scope["type"] == "http":
            receive, refusal = await _whole(receive)
        if refusal is not None:
            headers = (
                HEADERS | {"connection": "close"} | ({"location": refusal.to} if refusal.to else {})
            )
            await PlainTextResponse(refusal.why, refusal.status, headers)(scope, receive, send)
            return

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(HEADERS)
            await send(message)

        try:
            async with asyncio.timeout(ANSWER_S if scope["type"] == "http" else None):
                await self._app(scope, receive, sending)
        except TimeoutError:
            return  # the answer stays incomplete, so the server closes the connection


async def _whole(receive: Receive) -> tuple[Receive, HttpRefusal | None]:
    """Read the whole body of a request. Return a new `receive`, which yields this body, and None. If
    the request must be refused, return the refusal instead of None."""
    body, more = b"", True
    try:
        async with asyncio.timeout(BODY_S):
            while more:
                message = await receive()
                body += message.get("body", b"")
                more = message.get("more_body", False)
                if len(body) > MOST_BODY:
                    return receive, HttpRefusal(
                        413, f"a request may have at most {MOST_BODY} bytes"
                    )
    except TimeoutError:
        return receive, HttpRefusal(408, f"a request must arrive within {BODY_S:.0f} s")
    parts = [{"type": "http.request", "body": body, "more_body": False}]

    async def whole() -> Message:
        return parts.pop() if parts else await receive()

    return whole, None
