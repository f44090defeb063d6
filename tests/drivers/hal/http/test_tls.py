"""An HTTP bus with TLS: trusted authorities, and the time limit of a call. The limit includes TLS."""

import ssl
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, cast

import pytest
import trustme

from drivers.hal import HalError
from drivers.hal.http import HttpBus, HttpSettings


class Answers(BaseHTTPRequestHandler):
    """A handler that answers each request, and records its path and key."""

    def do_GET(self) -> None:
        server: Any = self.server
        key = self.headers.get("X-API-Key", "")
        server.asked.append(f"{self.path} {key}".strip())
        body = b'{"output": true}'
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body) + server.lacks))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing, because nobody reads the server's log."""


class Site:
    """A server with a certificate for 127.0.0.1. `ca_file` is the certificate of the server's
    authority."""

    def __init__(self, tmp_path: Path) -> None:
        authority = trustme.CA()
        self.ca_file = tmp_path / "ca.pem"
        authority.cert_pem.write_to_path(str(self.ca_file))
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        authority.issue_cert("127.0.0.1").configure_cert(context)
        self.server = cast(Any, ThreadingHTTPServer(("127.0.0.1", 0), Answers))
        self.server.daemon_threads = True
        self.server.asked = []
        self.server.lacks = 0
        self.server.socket = context.wrap_socket(self.server.socket, server_side=True)
        self.base = f"https://127.0.0.1:{self.server.server_address[1]}"

    def bus(self, **also: Any) -> HttpBus:
        """Return a bus to this server."""
        return HttpBus(
            HttpSettings(
                **{"api_base": self.base, "ca_file": str(self.ca_file), "timeout_s": 5.0, **also}
            )
        )


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    made = Site(tmp_path)
    thread = threading.Thread(target=made.server.serve_forever, args=(0.02,))
    thread.start()
    yield made
    made.server.shutdown()
    made.server.server_close()
    thread.join()


def test_a_reading_and_a_command_go_through_with_the_key_in_its_header(
    site: Site, tmp_path: Path
) -> None:
    key = tmp_path / "key"
    key.write_text("secret\n")
    key.chmod(0o600)
    bus = site.bus(token_file=str(key), token_header="X-API-Key")
    assert bus.get_json("/status?id=0") == {"output": True}
    bus.send("/relay/0?turn=on&timer=9", "GET")
    bus.close()
    assert site.server.asked == ["/status?id=0 secret", "/relay/0?turn=on&timer=9 secret"]


def test_a_server_signed_by_somebody_else_is_not_believed(site: Site, tmp_path: Path) -> None:
    other = tmp_path / "other.pem"
    trustme.CA().cert_pem.write_to_path(str(other))
    for ca_file in (str(other), None):
        bus = site.bus(ca_file=ca_file)
        with pytest.raises(
            HalError,
            match=r"TLS with .* fails: .*certificate.*: check ca_file",
        ):
            bus.get_json("/status")
        bus.close()
    assert site.server.asked == []


def test_an_answer_that_stops_half_way_ends_by_the_deadline(site: Site) -> None:
    site.server.lacks = 100
    bus = site.bus(timeout_s=1.0)
    with pytest.raises(HalError, match=r"no complete HTTP answer|no complete answer within 1 s"):
        bus.get_json("/status")
    bus.close()


def test_a_missing_ca_file_is_named(site: Site) -> None:
    bus = site.bus(ca_file="/no/such/ca.pem")
    with pytest.raises(HalError, match=r"fails: /no/such/ca\.pem is not a file: check ca_file"):
        bus.get_json("/status")
    bus.close()
