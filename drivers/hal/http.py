"""HTTP: one controller that answers requests, through requests.

Every call has one deadline from the lookup of the name to the last byte of the body
(`drivers/hal/deadline.py`). The body is capped; proxies, redirects and compression are off. A kept
connection that the server has closed is dialled again for a GET; a command is sent on a new connection,
and once, whatever becomes of it.
"""

import http.client
import json
import re
import socket
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import msgspec

from bridges import secret_file
from bridges.core.fields import Name, Period
from drivers.hal import Bus, BusType, HalError, Where
from drivers.hal.backoff import Backoff
from drivers.hal.deadline import Dialler, Resolve

if TYPE_CHECKING:
    from requests.adapters import HTTPAdapter

BODY_MAX = 64 * 1024
HEADERS = {"Accept": "application/json", "Accept-Encoding": "identity", "User-Agent": "rmf-bridges"}
JSON = {"Content-Type": "application/json"}

Method = Literal["POST", "PUT"]
Timeout = Annotated[float, msgspec.Meta(ge=0.1, le=30, extra={"unit": "s"})]

_BASE = re.compile(
    r"(?:http://)?"
    r"(?P<host>[A-Za-z0-9_](?:[A-Za-z0-9_.-]{0,251}[A-Za-z0-9])?|\[[0-9A-Fa-f:.]+\])"
    r"(?::(?P<port>[0-9]{1,5}))?"
    r"(?P<path>(?:/[A-Za-z0-9._~-]+)*)/?"
)
_HINTS = {
    3: "redirects are not followed: put the final address in api_base",
    4: "check api_base, the path, and token_file where the charger wants one",
    5: "the controller's own software fails: look at its log",
}


class Base(NamedTuple):
    """An `api_base` in parts. `path` is "" or begins with a slash and does not end with one."""

    host: str
    port: int
    path: str

    def url(self, path: str) -> str:
        """The address of one resource of the API."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}{'' if self.port == 80 else f':{self.port}'}{self.path}{path}"


def base(text: str) -> Base:
    """The parts of an `api_base`. Raises ValueError with what to write instead."""
    if text.lower().startswith("https:"):
        raise ValueError("https is not supported: write the address of the plain HTTP API")
    if "@" in text:
        raise ValueError("no user or password here: put a bearer token in a file, as token_file")
    found = _BASE.fullmatch(text)
    if not found:
        raise ValueError(f"{text!r} is no address of an API: write 192.168.1.60:8080/api, say")
    port = int(found["port"] or 80)
    if not 1 <= port <= 65535:
        raise ValueError(f"port {port} does not exist: ports are 1 to 65535")
    return Base(found["host"].strip("[]"), port, found["path"])


class Settings(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    tag="http",
):
    """A controller's HTTP API.

    `api_base`: host, port and path that every path begins with (`192.168.1.60:8080/api`).
    `timeout_s`: for a whole call, from the lookup of the name to the last byte.
    `scan_s`: how often the controller is read.
    `token_file`: a file that holds a bearer token, readable by the daemon alone.
    """

    api_base: Name
    timeout_s: Timeout = 1.0
    scan_s: Period = 1.0
    token_file: Name | None = None

    def problems(self) -> Iterable[tuple[tuple[str, ...], str]]:
        """What cannot be right about the address."""
        try:
            base(self.api_base)
        except ValueError as error:
            yield ("api_base",), str(error)


def warnings(settings: Settings) -> Iterable[tuple[tuple[str, ...], str]]:
    """What is legal but worth a look: (path, text)."""
    if settings.token_file:
        text = (
            "the token goes over the network unencrypted: keep chargers on a network of their own"
        )
        yield ("token_file",), text


def where(settings: Settings) -> Where:
    """The controller's address."""
    return Where(base(settings.api_base).url(""), local=False)


def open_bus(settings: Settings) -> "HttpBus":
    """The way to this controller; nothing is sent yet."""
    return HttpBus(settings)


class HttpBus(Bus):
    """Calls to one controller. Every failure is a HalError that says what to look at.

    `clock` and `resolve` are a test's in place of the real ones.
    """

    def __init__(
        self,
        settings: Settings,
        clock: Callable[[], float] = time.monotonic,
        resolve: Resolve = socket.getaddrinfo,
    ) -> None:
        self._settings = settings
        self._base = base(settings.api_base)
        self._dialler = Dialler(self._base.host, self._base.port, resolve)
        self._adapter = _adapter(self._dialler)
        self._backoff, self._safe_backoff = (Backoff(clock, lambda: 0.0) for _ in range(2))

    def get_json(self, path: str) -> dict[str, Any]:
        """GET `api_base` + `path`, which must answer 200 with one JSON object."""
        url = self._base.url(path)
        with self._attempt(self._backoff):
            return _json_object(url, *self._get(url))

    def send(
        self, path: str, method: Method = "POST", body: str | None = None, safe: bool = False
    ) -> None:
        """A command, with `body` (JSON) if any; any 2xx is success.

        Sent at most once, also when the answer is lost. `safe`: it takes power away, and waits for no
        pause that a reading has begun.
        """
        url = self._base.url(path)
        with self._attempt(self._safe_backoff if safe else self._backoff):
            self._adapter.close()  # a kept connection might be dead, and there is no second try
            self._call(method, url, body)

    def on_edge(self, wake: Callable[[], None]) -> None:
        """A polled bus has no edges."""

    def insist(self) -> None:
        """Try at once what is asked next, whatever the backoff."""
        self._backoff.insist()
        self._safe_backoff.insist()

    def close(self) -> None:
        """Hang up."""
        self._adapter.close()

    @contextmanager
    def _attempt(self, backoff: Backoff) -> Iterator[None]:
        """After a failure, calls fail at once, with the same text, until it is time again."""
        backoff.check()
        self._dialler.deadline.start(self._settings.timeout_s)
        try:
            yield
        except HalError as error:
            self._adapter.close()
            backoff.failed(str(error))
            raise
        backoff.mended()

    def _get(self, url: str) -> tuple[str, bytes]:
        dialled = self._dialler.dialled
        try:
            return self._call("GET", url)
        except _HungUp:
            if self._dialler.dialled > dialled:
                raise
        self._adapter.close()  # it was a kept connection: once more, in the time that is left
        return self._call("GET", url)

    def _call(self, method: str, url: str, sent: str | None = None) -> tuple[str, bytes]:
        """Content type and body of a good answer; what answers a command is not looked at."""
        import requests
        import urllib3

        self._dialler.failure = None
        headers = HEADERS | self._authorization() | (JSON if sent else {})
        request = requests.Request(method, url, headers, data=sent and sent.encode()).prepare()
        try:
            with self._adapter.send(request, stream=True) as answer:
                _check_status(url, method, answer.status_code)
                if method != "GET":
                    return "", b""
                body = _capped(answer.raw)
        except (
            requests.RequestException,
            urllib3.exceptions.HTTPError,
            http.client.HTTPException,
            OSError,
        ) as error:
            raise self._explained(url, error) from error
        if len(body) > BODY_MAX:
            raise HalError(
                f"{url} answered more than {BODY_MAX // 1024} KiB: is it the right path?"
            )
        return answer.headers.get("Content-Type", ""), body

    def _authorization(self) -> dict[str, str]:
        """The token is read for each call, so that it can be renewed while we run."""
        file = self._settings.token_file
        if file is None:
            return {}
        try:
            token = secret_file.one_line("token_file", file, "token")
        except secret_file.SecretError as error:
            raise HalError(str(error)) from None
        return {"Authorization": f"Bearer {token}"}

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
        return _HungUp(f"{url}: no whole HTTP answer ({_cause(error)}): is it an HTTP server?")


class _HungUp(HalError):
    """A connection was there and ended without an answer."""


def _adapter(dialler: Dialler) -> "HTTPAdapter":
    """requests' way to the wire, on the dialler's connections.

    Without a Session: it would read the whole body of a redirect that it is told not to follow, keep
    cookies, and look at the environment for proxies and passwords.
    """
    from requests.adapters import HTTPAdapter
    from urllib3 import HTTPConnectionPool
    from urllib3.connection import HTTPConnection

    class Connection(HTTPConnection):
        def _new_conn(self) -> socket.socket:
            return dialler.dial()

    class Pool(HTTPConnectionPool):
        ConnectionCls = Connection

    adapter = HTTPAdapter(pool_connections=1, pool_maxsize=1, max_retries=0)
    adapter.poolmanager.pool_classes_by_scheme = {"http": Pool}
    return adapter


def _check_status(url: str, method: str, status: int) -> None:
    if status == 200 or (method != "GET" and 200 <= status < 300):
        return
    hint = _HINTS.get(status // 100, "200 is expected")
    raise HalError(f"{url} answered status {status}: {hint}")


def _capped(raw: Any) -> bytes:
    """A body to its end, or one byte more than is allowed. A body cut short shows in the last read."""
    body = b""
    while len(body) <= BODY_MAX and (
        more := raw.read(BODY_MAX + 1 - len(body), decode_content=False)
    ):
        body += more
    return body


def _cause(error: BaseException) -> str:
    """The first failure below all that requests and urllib3 have wrapped around it."""
    while (below := error.__cause__ or error.__context__) is not None:
        error = below
    return _shown(str(error) or type(error).__name__)


def _shown(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:80])


def _json_object(url: str, content_type: str, body: bytes) -> dict[str, Any]:
    sort = content_type.partition(";")[0].strip().lower()
    if sort != "application/json" and not sort.endswith("+json"):
        what = _shown(sort) or "no content type"
        raise HalError(f"{url} answered {what} instead of JSON: is api_base the API's address?")
    try:
        found = json.loads(
            body.decode(), parse_constant=_no_number, object_pairs_hook=_without_doubles
        )
    except (ValueError, RecursionError) as error:
        raise HalError(f"{url} answered JSON that is none: {_shown(str(error))}") from None
    if not isinstance(found, dict):
        raise HalError(f"{url} answered JSON that is no object: {_shown(repr(found))}")
    return found


def _no_number(word: str) -> Any:
    raise ValueError(f"{word} is no JSON")


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object that says two things under one name says nothing."""
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name stands twice in one object")
    return found


BUS = BusType(
    settings=Settings,
    open_bus=open_bus,
    fake="hal_fakes.http",
    where=where,
    warnings=warnings,
)
