"""Requests that the page's server refuses. The tests send these requests directly, without a
browser."""

import http.client
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest

from tests.workbench.page.browser.conftest import PASSWORD, USER, on_graph, page

pytestmark = pytest.mark.browser
FORM = {"Content-Type": "application/x-www-form-urlencoded"}


PROXY, GUESSER, FLOOD = "127.0.0.9", "127.0.0.8", "127.0.0.7"
"""Addresses from which the test asks the page. The page limits the rate of each address."""


@pytest.fixture(scope="module")
def address(module_domain: int, folder: Path) -> Iterator[str]:
    words = ("--passwords", str(folder / "passwords"), "--runtime-dirs", str(folder / "run"))
    with page(*on_graph(module_domain), *words, "--proxy", PROXY) as found:
        yield found


def ask(
    address: str,
    path: str,
    headers: dict[str, str] | None = None,
    body: str = "",
    method: str = "",
    came_from: str = "127.0.0.1",
) -> tuple[int, dict[str, str], str]:
    """Send a request, and return the answer's status, headers and body."""
    place, at = urlsplit(address), (came_from, 0)
    connection = http.client.HTTPConnection(
        place.hostname or "", place.port or 0, timeout=60, source_address=at
    )
    connection.request(method or ("POST" if body else "GET"), path, body or None, headers or {})
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read().decode(errors="replace")
    connection.close()
    return found


def form(user: str = USER, password: str = PASSWORD) -> str:
    return f"user={quote(user)}&password={quote(password)}"


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", ""])
def test_a_host_of_another_name_is_refused(address: str, host: str) -> None:
    status, _, text = ask(address, "/", {"Host": host})
    assert (status, text) == (403, "this page does not serve that host name")


def test_a_login_from_another_origin_is_refused(address: str) -> None:
    status, headers, _ = ask(address, "/login", {**FORM, "Origin": "http://evil.example"}, form())
    assert status == 403
    assert "set-cookie" not in headers


@pytest.mark.parametrize("origin", ["http://evil.example", "null", ""])
def test_a_socket_from_another_origin_is_refused(address: str, origin: str) -> None:
    asked = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    }
    asked |= {"Origin": origin} if origin else {}
    path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert ask(address, path, asked)[0] == 403


def test_a_cookie_is_for_this_page_only_and_secure_if_the_login_came_over_tls(
    address: str,
) -> None:
    host = urlsplit(address).netloc
    status, headers, _ = ask(address, "/login", {**FORM, "Origin": f"http://{host}"}, form())
    flags = {part.strip() for part in headers["set-cookie"].split(";")[1:]}
    assert (status, headers["location"]) == (303, "/")
    assert flags == {"HttpOnly", "Path=/", "SameSite=strict"}
    _, headers, _ = ask(address, "/login", {**FORM, "Origin": f"https://{host}"}, form())
    assert "Secure" in headers["set-cookie"]


def test_a_session_id_chosen_before_the_login_is_not_used(address: str) -> None:
    given = {**FORM, "Cookie": "rmf_bridge_page=chosen-by-somebody-else"}
    _, headers, _ = ask(address, "/login", given, form())
    assert "chosen-by-somebody-else" not in headers["set-cookie"]


@pytest.mark.parametrize("path", ["//evil.example", "https://evil.example", "/\\evil.example"])
def test_a_login_never_redirects_to_another_site(address: str, path: str) -> None:
    _, headers, _ = ask(address, f"/login?next={quote(path)}", FORM, form())
    assert headers["location"] == "/"


def test_a_logout_with_a_guessed_proof_is_refused(address: str) -> None:
    _, headers, _ = ask(address, "/login", FORM, form())
    cookie = {"Cookie": headers["set-cookie"].split(";")[0]}
    assert ask(address, "/logout", FORM | cookie, "proof=guessed")[0] == 403
    assert "Log out" in ask(address, "/", cookie)[2]


def test_the_server_names_no_version_and_believes_no_forwarded_address(address: str) -> None:
    _, headers, text = ask(address, "/", {"X-Forwarded-For": "10.0.0.5", "X-Remote-User": "root"})
    assert "server" not in {name.lower() for name in headers}
    assert "Log in" in text
    assert headers["x-frame-options"] == "DENY"
    assert "default-src 'self'" in headers["content-security-policy"]


def test_a_form_that_never_ends_is_not_read(address: str) -> None:
    assert ask(address, "/login", FORM, form(password="x" * 100_000))[0] == 413


def test_after_five_wrong_passwords_the_right_one_has_to_wait_at_that_address(address: str) -> None:
    wrong = form(password="wrong")
    answers = [ask(address, "/login", FORM, wrong, came_from=GUESSER)[0] for _ in range(6)]
    assert answers == [403] * 6
    assert "wait a minute" in ask(address, "/login", FORM, form(), came_from=GUESSER)[2]
    assert ask(address, "/login", FORM, form())[0] == 303


def test_a_proxys_header_is_believed_only_from_the_proxy(address: str) -> None:
    claims = {"X-Remote-User": "<b>mallory</b>"}
    assert "mallory" not in ask(address, "/", claims)[2]
    found = ask(address, "/", claims, came_from=PROXY)[2]
    assert "mallory" in found
    assert "<b>mallory" not in found


def test_beyond_this_machine_nothing_is_shown_before_the_login_and_views_are_bounded(
    folder: Path,
) -> None:
    words = (str(folder / "incidents/ride.mcap"), "--passwords", str(folder / "passwords"))
    with page(*words, listen="0.0.0.0:0") as shown:
        address = shown.replace("0.0.0.0", "127.0.0.1")
        for path in ("/", "/incidents", "/incidents/ride.mcap/file", "/nothing"):
            status, headers, text = ask(address, path)
            assert (status, headers["location"]) == (303, f"/login?next={path}")
            assert text == "log in first"
        _, headers, _ = ask(address, "/login", FORM, form())
        cookie = {"Cookie": headers["set-cookie"].split(";")[0]}
        answers = [ask(address, "/incidents", cookie)[0] for _ in range(60)]
        assert answers == [200] * 50 + [503] * 10


def test_the_librarys_own_addresses_show_nothing_of_ours(address: str) -> None:
    for path in ("/docs", "/openapi.json", "/redoc", "/_nicegui/auto/static/../../x", "/metrics"):
        status, _, text = ask(address, path)
        assert status == 404, path
        assert "Traceback" not in text


def test_a_socket_without_a_view_of_ours_receives_nothing(address: str) -> None:
    opened = ask(address, "/_nicegui_ws/socket.io/?EIO=4&transport=polling")
    assert opened[0] in (200, 400)
    assert "client" not in opened[2]


def test_a_flood_of_logins_is_answered_and_bounded(address: str) -> None:
    def guess(_: int) -> int:
        return ask(address, "/login", FORM, form("eve", "x"), came_from=FLOOD)[0]

    with ThreadPoolExecutor(30) as pool:
        answers = set(pool.map(guess, range(300)))
    assert answers <= {403, 503}
    assert ask(address, "/login")[0] == 200


def test_a_second_page_on_a_port_says_what_to_do(address: str) -> None:
    command = [sys.executable, "-m", "bridges.cli", "page", "--listen", urlsplit(address).netloc]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode == os.EX_UNAVAILABLE
    assert "Address already in use; for a free port: --listen" in ended.stderr
