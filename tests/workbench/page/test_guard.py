"""Requests that the page does not answer: unknown host names, and sockets and forms of other
origins."""

import pytest

from workbench.page.guard import refused

HOSTS = {"127.0.0.1:8080", "localhost:8080", "rmf.example"}


def asked(host: str, origin: str = "", method: str = "GET", kind: str = "http") -> str:
    headers = [(b"host", host.encode())]
    headers += [(b"origin", origin.encode())] if origin else []
    return refused({"type": kind, "method": method, "headers": headers}, HOSTS)


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8080", "LOCALHOST:8080", "rmf.example", "rmf.example:443"]
)
def test_requests_to_the_pages_own_names_are_answered(host: str) -> None:
    assert asked(host) == ""


@pytest.mark.parametrize(
    "host", ["", "evil.example", "127.0.0.1:8080.evil.example", "rmf.example.evil"]
)
def test_a_request_to_any_other_name_is_not_answered_so_dns_rebinding_fails(
    host: str,
) -> None:
    assert asked(host) == "this page does not serve that host name"


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://localhost:8081"])
@pytest.mark.parametrize(("method", "kind"), [("POST", "http"), ("GET", "websocket")])
def test_a_form_or_socket_of_another_origin_is_not_answered(
    origin: str, method: str, kind: str
) -> None:
    assert (
        asked("localhost:8080", origin, method, kind) == "that is for this page's own origin only"
    )


def test_a_socket_without_an_origin_is_not_answered() -> None:
    assert asked("localhost:8080", kind="websocket") == "no origin"


@pytest.mark.parametrize(("method", "kind"), [("POST", "http"), ("GET", "websocket")])
def test_the_pages_own_origin_may_post_and_open_a_socket(method: str, kind: str) -> None:
    assert asked("rmf.example", "https://rmf.example", method, kind) == ""
