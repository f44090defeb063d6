"""Old values on the page. The page may freeze or die, or its connection may stall. No view then shows
an old value as a present value."""

import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page

from bridges.messages import definitions as d
from tests.workbench.page.browser.conftest import Graph, Until, on_graph, page, program
from tests.workbench.page.browser.test_bad_days import page_pid
from tests.workbench.page.browser.test_page import card

pytestmark = pytest.mark.browser
WITHIN_MS = 3000
MORE = [f"door{number}" for number in range(20)]
"""So many doors that the view is longer than the screen."""
LEFT = "window.loadedOnce = true"


class Relay:
    """A wire between the browser and the page. After `cut` the wire carries nothing, but closes no
    socket."""

    def __init__(self, address: str) -> None:
        self.behind, place = address, urlsplit(address)
        self._to = (place.hostname or "", place.port or 0)
        self._opened: list[socket.socket] = []
        self._listens = socket.create_server(("127.0.0.1", 0))
        self.cut = Event()
        self.address = f"http://127.0.0.1:{self._listens.getsockname()[1]}/"
        Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._listens.accept()
                far = socket.create_connection(self._to)
                self._opened += [near, far]
                for ends in ((near, far), (far, near)):
                    Thread(target=self._carry, args=ends, daemon=True).start()

    def _carry(self, from_: socket.socket, to: socket.socket) -> None:
        with suppress(OSError):
            while told := from_.recv(65536):
                if not self.cut.is_set():
                    to.sendall(told)
            to.shutdown(socket.SHUT_WR)

    def close(self) -> None:
        for one in (self._listens, *self._opened):
            one.close()


@pytest.fixture(scope="module")
def relay(module_domain: int) -> Iterator[Relay]:
    with page(*on_graph(module_domain)) as behind:
        made = Relay(behind)
        yield made
        made.close()


@pytest.fixture(scope="module")
def address(relay: Relay) -> str:
    """Return the relay's address. Through the relay, the browser reaches the page."""
    return relay.address


def cards(tab: Page) -> list[str]:
    return [card(tab, name) for name in ("Lift1", "ward")]


def all_is_now(tab: Page) -> bool:
    return all("\nnow\n" in one and "OLD" not in one for one in cards(tab))


def is_old(shown: str) -> bool:
    return "\nwas\n" in shown and "OLD: the page's server is silent" in shown


@contextmanager
def seen_as_old(tab: Page, graph: Graph, until: Until, address: str) -> Iterator[None]:
    """Let the block stop the page. Then check that every card is marked old.

    By the browser's clock a card is marked within WITHIN_MS.
    """
    graph.lift("Lift1", "L1", 2, "fleet/robot")
    graph.doors |= {name: d.DoorState(door_name=name) for name in ("ward", *MORE)}
    tab.clock.install()
    tab.goto(address)
    until(lambda: all_is_now(tab), "all to be now")
    yield
    tab.clock.run_for(WITHIN_MS)
    assert [one for one in cards(tab) if not is_old(one)] == []
    tab.evaluate("scrollTo(0, document.body.scrollHeight)")
    alert = tab.get_by_role("alert")
    assert "OLD: for" in alert.inner_text()
    box, view = alert.bounding_box(), tab.viewport_size
    assert box is not None
    assert view is not None
    assert 0 <= box["y"] <= view["height"] - box["height"]
    assert tab.title().startswith("OLD ")


def test_a_frozen_page_is_old_within_three_seconds_and_now_when_it_goes_on(
    tab: Page, address: str, relay: Relay, graph: Graph, until: Until
) -> None:
    pid = page_pid(relay.behind)
    with seen_as_old(tab, graph, until, address):
        os.kill(pid, signal.SIGSTOP)
    tab.evaluate(LEFT)
    os.kill(pid, signal.SIGCONT)
    until(lambda: all_is_now(tab), "all to be now again")
    assert tab.evaluate("window.loadedOnce")


def test_a_connection_that_carries_nothing_is_old_within_three_seconds(
    tab: Page, address: str, relay: Relay, graph: Graph, until: Until
) -> None:
    with seen_as_old(tab, graph, until, address):
        relay.cut.set()
    relay.cut.clear()


def test_a_killed_page_is_old_within_three_seconds_on_a_devices_own_view_too(
    tab: Page, address: str, graph: Graph, until: Until, complaints: list[str]
) -> None:
    killed = program("page", "--listen", "127.0.0.1:0", *graph.options, ends=-signal.SIGKILL)
    with killed as started:
        assert started.stdout is not None
        itself = started.stdout.readline().split()[4]
        graph.lift("Lift1", "L1", 2, "fleet/robot")
        with seen_as_old(tab, graph, until, itself):
            other = tab.context.new_page()
            other.clock.install()
            other.goto(f"{itself}lift/Lift1")
            own = other.locator("article.card")
            # while this view loaded, the site published nothing, and its devices became silent
            until(lambda: "\nnow\n" in own.inner_text() and all_is_now(tab), "all to be now")
            started.kill()
            started.wait()
        other.clock.run_for(WITHIN_MS)
        assert "\nwas\n" in own.inner_text()
    complaints.clear()  # these complaints come from the death of the page
