"""The page on bad days: the network fails and returns, a browser never reads, and sockets are idle."""

import re
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page
from websockets import Origin
from websockets.sync.client import connect

from bridges.kinds.shared.rmf_section import Zenoh
from bridges.transports.zenoh.transport import ZenohTransport
from tests.transports.zenoh_programs import Router
from tests.waiting import wait_until
from tests.workbench.page.browser.conftest import Graph, Until, page
from tests.workbench.page.browser.test_page import card
from tests.workbench.page.browser.test_safety import ask

pytestmark = pytest.mark.browser
MOST_GROWTH_MB = 60
LONG = 4000 * "x"
"""A long ending for a session's name. With such names a socket's buffers fill soon."""
RELOADED = "window.loadedOnce === undefined"


@pytest.fixture(scope="module")
def router() -> Iterator[Router]:
    made = Router()
    made.start()
    yield made
    made.leave()


@pytest.fixture(scope="module")
def graph(module_domain: int, router: Router) -> Iterator[Graph]:
    """Yield a site whose messages reach the page through a router."""
    settings = Zenoh(connect=(router.endpoint,), mode="client")
    transport = ZenohTransport("site", module_domain, loopback=False, settings=settings)
    made = Graph(module_domain, transport)
    yield made
    made.close()


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of the page's log."""
    return tmp_path_factory.mktemp("log") / "page"


@pytest.fixture(scope="module")
def address(
    module_domain: int, router: Router, folder: Path, said: Path, graph: Graph
) -> Iterator[str]:
    yaml = Path("config/door_modbus.yaml").read_text()
    zenoh = f"{{mode: client, connect: [{router.endpoint}]}}"
    rmf = f"rmf: {{transport: zenoh, domain_id: {module_domain}, zenoh: {zenoh}}}\n"
    file = folder / "door.yaml"
    file.write_text(re.sub(r"^rmf:\n(?:[ #].*\n|\n)*", rmf, yaml, flags=re.M))
    words = ("--config", str(file), "--runtime-dirs", str(folder / "run"))
    with page(*words, log=said) as found:
        yield found


def test_when_the_network_fails_everything_is_marked_old_and_recovers_without_a_reload(
    tab: Page, address: str, graph: Graph, router: Router, until: Until
) -> None:
    graph.lift("Lift1", "L1", 0, "fleet/robot")
    graph.lift("Lift2")
    tab.goto(address)
    until(lambda: "now" in card(tab, "Lift1"), "the lift")
    tab.evaluate("window.loadedOnce = true")
    router.die()
    until(lambda: "OLD: silent" in card(tab, "Lift1"), "the lift to turn old")
    until(lambda: "OLD: silent" in card(tab, "Lift2"), "the other to turn old")
    until(lambda: "no router answers" in tab.locator("#status").inner_text(), "it to be said")
    assert "now" not in card(tab, "Lift1").split()
    router.start()
    graph.lift("Lift1", "L3", 2, "fleet/robot")
    until(lambda: "car at L3" in card(tab, "Lift1"), "the lift to be back")
    until(lambda: "OLD" not in card(tab, "Lift1") + card(tab, "Lift2"), "all to be back")
    assert tab.evaluate(RELOADED) is False


def test_a_browser_that_never_reads_is_ended_and_others_see_all(
    tab: Page, address: str, graph: Graph, until: Until, said: Path
) -> None:
    for number in range(20):
        graph.lift(f"Tower{number:02}", "L1", 0, "fleet/robot")
    tab.goto(address)
    until(lambda: "L1" in card(tab, "Tower19"), "the lifts")
    pid = page_pid(address)
    before = rss_mb(pid)
    ended_before = said.read_text().count("browser_does_not_read")
    turn = 0

    def ended() -> bool:
        """Change all lifts, so that the page must send much. Return whether the page has ended the
        socket that never reads."""
        nonlocal turn
        turn += 1
        for number in range(20):
            graph.lift(f"Tower{number:02}", f"L{1 + turn % 3}", 0, f"fleet/robot_{turn}" + LONG)
        return said.read_text().count("browser_does_not_read") > ended_before

    with deaf(address):
        until(ended, "the page to end it")
        seen = f"fleet/robot_{turn}"
        until(lambda: seen in card(tab, "Tower19"), "what is new, in the browser that reads")
        assert rss_mb(pid) - before < MOST_GROWTH_MB
    for number in range(20):
        del graph.lifts[f"Tower{number:02}"]


def test_idle_sockets_and_nonsense_keep_nobody_out(tab: Page, address: str) -> None:
    place = urlsplit(address)
    there = (place.hostname or "", place.port or 0)
    with ExitStack() as opened:
        silent = [opened.enter_context(socket.create_connection(there)) for _ in range(240)]
        for one in silent[::3]:
            one.sendall(b"\x16\x03\x01\x02\x00garbage\r\n\r\n")
        for one in silent[1::3]:
            one.sendall(b"GET / HTTP/1.1\r\nHost: ")
        wait_until(lambda: ask(address, "/incidents")[0] == 200, "the page answers others")
        assert all(is_closed(one) for one in silent)


def is_closed(opened: socket.socket) -> bool:
    """Wait until the other end has closed the socket, and return True."""
    opened.settimeout(60.0)
    try:
        while opened.recv(4096):
            pass
    except ConnectionError:
        pass
    return True


@contextmanager
def deaf(address: str) -> Iterator[None]:
    """Open a socket as a view's script does. Nobody ever reads from this socket."""
    _, _, text = ask(address, "/")
    found = re.search(r"'client_id': '([0-9a-f-]+)'", text)
    assert found
    query = f"client_id={found[1]}&next_message_id=0&implicit_handshake=true&document_id=d&tab_id=t"
    where = (
        f"{address.replace('http', 'ws')}_nicegui_ws/socket.io/?{query}&EIO=4&transport=websocket"
    )
    opened = socket.create_connection((urlsplit(address).hostname, urlsplit(address).port))
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with connect(
        where,
        sock=opened,
        origin=Origin(address.rstrip("/")),
        max_queue=1,
        close_timeout=0,
        ping_interval=None,
        compression=None,
    ) as joined:
        joined.recv()
        joined.send("40")
        yield


def page_pid(address: str) -> int:
    """Return the id of the process that listens at this address."""
    port = f":{urlsplit(address).port}"
    listening = [
        line.split()[9]
        for line in Path("/proc/net/tcp").read_text().splitlines()[1:]
        if line.split()[1].endswith(f":{urlsplit(address).port:04X}") and line.split()[3] == "0A"
    ]
    assert listening, port
    link = f"socket:[{listening[0]}]"
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if any(str(one.readlink()) == link for one in (folder / "fd").iterdir()):
                return int(folder.name)
        except OSError:
            continue
    raise AssertionError("nobody listens")


def rss_mb(pid: int) -> float:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024
