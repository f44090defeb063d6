"""Logins with user and password: digest (RFC 7616), basic, and refused logins.

The server verifies each digest.
"""

import hashlib
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from drivers.hal import HalError
from drivers.hal.http import HttpBus, HttpSettings, warnings
from drivers.hal.http_login import Login
from tests.drivers.hal.http.far_end import FarEnd, answer, once
from tests.drivers.hal.http.test_bus import Clock

USER, PASSWORD = "robots", "s3cret-word"


def hashed(*parts: str) -> str:
    return hashlib.md5(":".join(parts).encode()).hexdigest()


class DigestServer(ThreadingHTTPServer):
    """A server that answers only requests with a correct digest.

    `nonce` is the valid nonce. `done` has the accepted requests, each with the nonce's counter.
    """

    daemon_threads = True

    def __init__(self) -> None:
        self.nonce = "first"
        self.done: list[str] = []
        self.refused = 0
        super().__init__(("127.0.0.1", 0), _Digest)


class _Digest(BaseHTTPRequestHandler):
    server: DigestServer

    def do_GET(self) -> None:
        self.rfile.read(int(self.headers.get("Content-Length", "0")))
        given = dict(re.findall(r'(\w+)="?([^",]+)"?', self.headers.get("Authorization", "")))
        secret = hashed(USER, "lift", PASSWORD)
        asked = hashed(self.command, self.path)
        wanted = hashed(
            secret, self.server.nonce, given.get("nc", ""), given.get("cnonce", ""), "auth", asked
        )
        if given.get("response") != wanted or given.get("nonce") != self.server.nonce:
            self.server.refused += 1
            self.send_response(401)
            self.send_header(
                "WWW-Authenticate",
                f'Digest realm="lift", qop="auth", nonce="{self.server.nonce}", algorithm=MD5',
            )
            self.send_header("Content-Length", str(10**9))
            self.end_headers()
            self.wfile.write(b"x" * 1000)
            return
        self.server.done.append(f"{self.command} {self.path} {int(given['nc'], 16)}")
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", "2")
        self.end_headers()
        self.wfile.write(b"{}")

    do_POST = do_GET

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing."""


@contextmanager
def digest_server() -> Iterator[DigestServer]:
    server = DigestServer()
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture
def password(tmp_path: Path) -> Path:
    file = tmp_path / "password"
    file.touch(mode=0o600)
    file.write_text(f"{PASSWORD}\n")
    return file


def bus_to(port: int, password: Path, method: Any = "digest") -> HttpBus:
    login = Login(user=USER, password_file=str(password), method=method)
    made = HttpSettings(api_base=f"127.0.0.1:{port}", login=login, timeout_s=5.0)
    return HttpBus(made, Clock())


def test_a_challenged_call_is_signed_and_done_once_and_the_next_ones_are_signed_at_once(
    password: Path,
) -> None:
    with digest_server() as server:
        bus = bus_to(server.server_address[1], password)
        bus.get_json("/state?a=1")
        bus.send("/call", "POST", '{"to": 1}')
        bus.get_json("/state?a=1")
        assert server.done == ["GET /state?a=1 1", "POST /call 2", "GET /state?a=1 3"]
        assert server.refused == 1
        server.nonce = "second"
        bus.send("/call")
        assert (server.done[-1], server.refused) == ("POST /call 1", 2)
        bus.close()


def test_a_wrong_password_is_refused_and_shown_nowhere_and_a_renewed_one_counts(
    password: Path,
) -> None:
    password.write_text("wr0ng-word")
    with digest_server() as server:
        bus = bus_to(server.server_address[1], password)
        with pytest.raises(HalError, match=r"answered status 401: check .* login") as caught:
            bus.send("/call")
        assert not re.search(r"wr0ng|s3cret", str(caught.value))
        assert (server.done, server.refused) == ([], 2)
        password.write_text(PASSWORD)
        bus.send("/call")
        assert server.done == ["POST /call 2"]
        bus.close()


@pytest.mark.parametrize(
    "asked", ["Digest", "Digest nonce", 'Digest realm="x"', "Digest " + "a=b," * 2000, "Basic x=y"]
)
def test_a_challenge_that_makes_no_sense_is_a_hal_error(password: Path, asked: str) -> None:
    refusal = answer(b"", "401 Unauthorized", f"WWW-Authenticate: {asked}\r\n")
    with FarEnd(once(refusal)) as far:
        bus = bus_to(far.port, password)
        with pytest.raises(HalError) as caught:
            bus.get_json("/state")
        bus.close()
    assert PASSWORD not in str(caught.value)


def test_basic_is_sent_with_each_call(password: Path) -> None:
    with FarEnd(once(answer())) as far:
        bus = bus_to(far.port, password, "basic")
        bus.get_json("/state")
        bus.close()
    assert b"\r\nAuthorization: Basic cm9ib3RzOnMzY3JldC13b3Jk\r\n" in far.requests[0]


@pytest.mark.parametrize("method", ["basic", "digest"])
def test_a_password_file_that_others_can_read_is_refused_and_nothing_is_sent(
    password: Path, method: str
) -> None:
    password.chmod(0o644)
    with FarEnd(once(answer())) as far:
        bus = bus_to(far.port, password, method)
        with pytest.raises(HalError, match="open to other users"):
            bus.get_json("/state")
        bus.close()
    assert far.requests == []


LOGIN = Login(user="a", password_file="/etc/p", method="basic")
DIGEST = Login(user="a", password_file="/etc/p", method="digest")


@pytest.mark.parametrize(
    ("settings", "wanted"),
    [
        ({"api_base": "tpu", "login": LOGIN}, "login"),
        ({"api_base": "localhost:81", "login": LOGIN}, ""),
        ({"api_base": "127.0.0.9", "login": LOGIN}, ""),
        ({"api_base": "[::1]", "login": LOGIN}, ""),
        ({"api_base": "https://tpu", "login": LOGIN}, ""),
        ({"api_base": "tpu", "login": DIGEST}, ""),
        ({"api_base": "tpu", "login": LOGIN, "accept_unencrypted": "a cable"}, ""),
        ({"api_base": "tpu", "login": DIGEST, "accept_unencrypted": "a"}, "accept_unencrypted"),
        ({"api_base": "tpu", "login": DIGEST, "token_file": "t"}, "login"),
        ({"api_base": "tpu", "login": DIGEST, "token_file": "t", "token_header": "X-K"}, ""),
        ({"api_base": "tpu", "login": DIGEST, "push_path": "/ws"}, "push_path"),
    ],
)
def test_a_password_that_anybody_could_read_is_refused_unless_the_site_gives_a_reason(
    settings: dict[str, Any], wanted: str
) -> None:
    found = [path[0] for path, _ in HttpSettings(**settings).problems()]
    assert found == ([wanted] if wanted else [])


def test_an_accepted_secret_is_still_warned_of_with_its_reason() -> None:
    for more in ({"login": LOGIN}, {"token_file": "t"}):
        made = HttpSettings(api_base="tpu", accept_unencrypted="its own cable", **more)
        assert list(warnings(made)) == [
            (
                ("accept_unencrypted",),
                "the secret goes over the network unencrypted: its own cable",
            )
        ]
