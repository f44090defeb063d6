"""One controller that answers HTTP requests, through the library requests. An https address uses TLS.

Every call has one deadline from the lookup of the name to the last byte of the body
(`drivers/hal/deadline.py`). The body has a maximum size. Proxies, redirects and compression are off.

Each call has a connection of its own, because a reply in HTTP/1.1 does not say which request it
answers. If a connection served several calls, a late or second reply could pass for the reply to the
next request. A call is sent only once.
"""

import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import chain
from typing import TYPE_CHECKING, TypeVar

from bridges.system import user_files
from drivers.hal import Bus, BusType, HalError
from drivers.hal.backoff import BACKOFF_MAX_S, Backoff
from drivers.hal.deadline import Dialler, Resolve, tls_socket
from drivers.hal.http_address import Base, Path, base
from drivers.hal.http_json import RefusedCall, WrongAnswer, excerpt, json_object
from drivers.hal.http_login import Signer
from drivers.hal.http_settings import HttpSettings, Method, needs, warnings, where

__all__ = ["Base", "HttpBus", "HttpSettings", "Method", "Path", "base", "warnings"]

if TYPE_CHECKING:
    from requests.adapters import HTTPAdapter
    from urllib3 import BaseHTTPResponse

    from drivers.hal.http_push import Pushes

K = TypeVar("K")

BODY_MAX = 64 * 1024
REMEMBERED_MAX = 256
"""The maximum number of wrong answers, and of lost commands, that the bus remembers."""
OFF_PAUSE_MAX_S = 3.0
"""The longest pause (s) of an off whose answer is lost while readings succeed."""
HEADERS = {
    "Accept": "application/json",
    "Accept-Encoding": "identity",
    "Connection": "close",
    "User-Agent": "rmf-bridges",
}
JSON = {"Content-Type": "application/json"}

_HINTS = {
    3: "redirects are not followed: put the final address in api_base",
    4: "check api_base and the path, and give token_file or login if the controller needs one",
    5: "the controller's own software fails: look at its log",
}


class HttpBus(Bus):
    """Calls to one controller. Every failure is a HalError, whose text says what to check.

    Tests replace `clock` and `resolve`.
    """

    def __init__(
        self,
        settings: HttpSettings,
        clock: Callable[[], float] = time.monotonic,
        resolve: Resolve = socket.getaddrinfo,
    ) -> None:
        self._settings = settings
        self._clock = clock
        self._base = base(settings.api_base)
        self._dialler = Dialler(self._base.host, self._base.port, resolve)
        self._adapter = _adapter(self._dialler, self._base.scheme)
        self._backoff, self._safe_backoff = (Backoff(clock, lambda: 0.0) for _ in range(2))
        self._wrong: dict[str, Backoff] = {}
        self._offs: dict[tuple[str, str | None], Backoff] = {}
        self._signer = Signer(settings.login) if settings.login else None
        self._pushes: Pushes | None = None

    def on_edge(self, wake: Callable[[], None]) -> None:
        """If the controller has a WebSocket, call `wake` at each of its messages."""
        if self._settings.push_path and self._pushes is None:
            from drivers.hal.http_push import Pushes

            self._pushes = Pushes(
                self._base.url(self._settings.push_path),
                self._headers,
                self._settings.ca_file,
                wake,
            )

    def get_json(
        self, path: str, method: Method = "GET", body: str | None = None
    ) -> dict[str, object]:
        """Read `api_base` + `path`, and return the JSON object of the answer. The answer must have
        status 200.

        Some controllers are read by another method than GET. `method` and `body` are for these.
        """
        url = self._base.url(path)
        with self._attempt(self._backoff, path):
            return json_object(url, *self._call(method, url, body, reads=True))

    def send(
        self, path: str, method: Method = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        """Send a command, with a JSON `body` if given. Any status 2xx is success.

        The command is sent at most once, even when the answer is lost. `safe` means that the command
        switches an output off. Such a command does not wait for the backoff of a failed reading.
        """
        url = self._base.url(path)
        with self._attempt(self._off(path, body) if safe else self._backoff, path):
            self._call(method, url, body)

    def ask(
        self, path: str, method: Method = "POST", body: str | None = None, safe: bool = False
    ) -> dict[str, object]:
        """Send a command as `send` does. Return the JSON object of its answer, which must have status
        200."""
        url = self._base.url(path)
        with self._attempt(self._off(path, body) if safe else self._backoff, path):
            return json_object(url, *self._call(method, url, body, reads=True))

    def _off(self, path: str, body: str | None) -> Backoff:
        """Return the backoff of a command that switches off. While readings succeed, a lost answer
        delays only the same command, because the others may be for other devices. While readings
        fail, the controller may be gone, and one backoff is for all."""
        if self._backoff.failing:
            return self._safe_backoff
        return _remember(self._offs, (path, body), self._clock, OFF_PAUSE_MAX_S)

    def insist(self) -> None:
        """Let the next call skip the backoff."""
        one_each = self._wrong.values(), self._offs.values()
        for backoff in (self._backoff, self._safe_backoff, *chain(*one_each)):
            backoff.insist()

    def close(self) -> None:
        """End the WebSocket, if there is one. No other connection stays open between calls."""
        if self._pushes:
            self._pushes.close()

    @contextmanager
    def _attempt(self, backoff: Backoff, path: str) -> Iterator[None]:
        """Run one attempt. During the backoff after a failure, do not run it, but raise the failure's
        text again. A wrong answer delays only its own path, because the other paths may belong to
        other devices."""
        backoff.check()
        wrong = self._wrong.get(path)
        if wrong is not None and backoff is self._backoff:
            wrong.check()
        self._dialler.deadline.start(self._settings.timeout_s)
        began, failed = self._clock(), True
        try:
            yield
            failed = False
        except WrongAnswer as error:
            _remember(self._wrong, path, self._clock).failed(str(error))
            backoff.mended()
            raise
        except HalError as error:
            backoff.failed(str(error))
            raise
        finally:
            self._adapter.close()
            self._dialler.hang_up()
            self.calls += 1
            where = f"{self._base.host}:{self._base.port}"
            self.units.ended(where, self._clock() - began, failed=failed)
        backoff.mended()
        self._wrong.pop(path, None)

    def _call(
        self, method: str, url: str, sent: str | None = None, reads: bool = False
    ) -> tuple[str, bytes]:
        """Return (content type, body) of a good answer. For a command, do not read the answer's
        body."""
        import requests

        self._dialler.failure = None
        verify = self._settings.ca_file or True
        headers = HEADERS | self._authorization() | (JSON if sent else {})
        request = requests.Request(method, url, headers, data=sent and sent.encode()).prepare()
        if self._signer:
            self._signer.sign(request)
        try:
            answer = self._adapter.send(request, stream=True, verify=verify)
            if self._signer and self._signer.is_challenge(answer):
                self._dialler.hang_up()
                answer = self._signer.answered(answer, verify)
            with answer:
                _check_status(url, reads, answer.status_code)
                if not reads:
                    return "", b""
                body = _capped(answer.raw)
        except HalError:
            raise
        except Exception as error:  # a server's bytes can make the libraries raise any exception
            raise self._explained(url, error) from error
        if len(body) > BODY_MAX:
            raise WrongAnswer(
                f"{url} answered more than {BODY_MAX // 1024} KiB: is it the right path?"
            )
        return answer.headers.get("Content-Type", ""), body

    def _headers(self) -> dict[str, str]:
        """Return the headers that open the WebSocket. Raises HalError."""
        return self._authorization() | (self._signer.basic() if self._signer else {})

    def _authorization(self) -> dict[str, str]:
        """Return the header with the token. Each call reads the token again, because somebody may have
        renewed it."""
        file = self._settings.token_file
        if file is None:
            return {}
        try:
            token = user_files.secret_line("token_file", file, "token")
        except user_files.SecretError as error:
            raise HalError(str(error)) from None
        header = self._settings.token_header
        return {header: token} if header else {"Authorization": f"Bearer {token}"}

    def _explained(self, url: str, error: BaseException) -> HalError:
        failure = self._dialler.failure
        where = f"{self._base.host}:{self._base.port}"
        if isinstance(failure, ConnectionRefusedError):
            return HalError(
                f"{where} refuses the connection: is the controller's HTTP server running there?"
            )
        if isinstance(failure, socket.gaierror):
            return HalError(f"{self._base.host} is not known: check the name and the DNS server")
        if self._dialler.deadline.passed() or isinstance(failure, TimeoutError):
            limit = f"{self._settings.timeout_s:g} s"
            return HalError(
                f"{url}: no complete answer within {limit}: check power, cable and address"
            )
        if failure is not None:
            return HalError(f"{where} cannot be reached: {failure.strerror or failure}")
        if reason := _tls_failure(error, self._settings.ca_file):
            return HalError(f"TLS with {where} fails: {reason}: check ca_file and api_base")
        return HalError(f"{url}: no complete HTTP answer ({_cause(error)}): is it an HTTP server?")


def _remember(
    table: dict[K, Backoff], key: K, clock: Callable[[], float], most_s: float = BACKOFF_MAX_S
) -> Backoff:
    """Return the backoff of this key. A full table forgets the key that came first."""
    if key not in table and len(table) >= REMEMBERED_MAX:
        del table[next(iter(table))]
    return table.setdefault(key, Backoff(clock, lambda: 0.0, most_s))


def _adapter(dialler: Dialler, scheme: str) -> "HTTPAdapter":
    """Make requests' HTTP adapter, which gets its connections from the dialler.

    This file uses no Session, for three reasons. A Session reads the whole body of a redirect, even
    when it must not follow the redirect. A Session keeps cookies. A Session takes proxies and passwords
    from the environment.
    """
    from requests.adapters import HTTPAdapter
    from urllib3 import HTTPConnectionPool, HTTPSConnectionPool
    from urllib3.connection import HTTPConnection, HTTPSConnection
    from urllib3.util.ssl_ import create_urllib3_context

    class Dialled:
        def _new_conn(self) -> socket.socket:
            return dialler.dial()

    class Connection(Dialled, HTTPConnection):
        """A connection without TLS."""

    class TlsConnection(Dialled, HTTPSConnection):
        """A connection with TLS."""

    class Pool(HTTPConnectionPool):
        ConnectionCls = Connection

    class TlsPool(HTTPSConnectionPool):
        ConnectionCls = TlsConnection

    adapter = HTTPAdapter(pool_connections=1, pool_maxsize=1, max_retries=0)
    adapter.poolmanager.pool_classes_by_scheme = {"http": Pool, "https": TlsPool}
    if scheme == "https":
        context = create_urllib3_context()  # no authorities here: `verify` of each call adds them
        context.sslsocket_class = tls_socket(dialler.deadline)
        adapter.poolmanager.connection_pool_kw["ssl_context"] = context
    return adapter


def _tls_failure(error: BaseException | None, ca_file: str | None) -> str:
    """Return the cause of a TLS failure. Return "" if TLS did not fail."""
    import ssl

    if ca_file and not os.path.isfile(ca_file):
        return f"{ca_file} is not a file"
    while error is not None and not isinstance(error, ssl.SSLError):
        error = error.__cause__ or error.__context__
    return excerpt(getattr(error, "verify_message", None) or str(error)) if error else ""


def _check_status(url: str, reads: bool, status: int) -> None:
    if status == 200 or (not reads and 200 <= status < 300):
        return
    hint = _HINTS.get(status // 100, "200 is expected")
    error = RefusedCall if status // 100 == 4 else WrongAnswer
    raise error(f"{url} answered status {status}: {hint}")


def _capped(raw: "BaseHTTPResponse") -> bytes:
    """Read the body, but at most BODY_MAX + 1 bytes. More bytes are useless, because the caller refuses
    a body above BODY_MAX. Read a shorter body until no more bytes come, because an incomplete body
    raises its error only at the last read."""
    body = b""
    while len(body) <= BODY_MAX and (
        more := raw.read(BODY_MAX + 1 - len(body), decode_content=False)
    ):
        body += more
    return body


def _cause(error: BaseException) -> str:
    """Return the root cause inside an exception of requests and urllib3."""
    while (below := error.__cause__ or error.__context__) is not None:
        error = below
    return excerpt(str(error) or type(error).__name__)


BUS = BusType(
    settings=HttpSettings,
    open_bus=HttpBus,
    fake="hal_fakes.http",
    where=where,
    needs=needs,
    warnings=warnings,
)
