"""A stranger's messages. The messages shut nobody out of the page, and fill neither its log nor its
memory."""

import os
import random
import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import pytest
from playwright.sync_api import Page

from tests.waiting import wait_until
from tests.workbench.page.browser.conftest import Graph, Until, on_graph, page
from tests.workbench.page.browser.test_bad_days import page_pid, rss_mb
from tests.workbench.page.browser.test_page import card
from tests.workbench.page.browser.test_safety import FORM, ask, form
from tests.workbench.page.strangers import MB, half_requests, long_names, strange_frames

pytestmark = pytest.mark.browser
MOST_MB = 200
"""The greatest permitted memory of the page (MB). The service's unit permits 256 MB."""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of the page's log."""
    return tmp_path_factory.mktemp("log") / "page"


@pytest.fixture(scope="module")
def address(module_domain: int, folder: Path, said: Path) -> Iterator[str]:
    strange = os.path.join(os.fsencode(folder / "incidents"), b"caf\xe9.mcap")
    with open(strange, "wb"):
        pass
    words = ["--passwords", str(folder / "passwords"), "--incidents", str(folder / "incidents")]
    with page(*on_graph(module_domain), *words, log=said) as found:
        yield found


@pytest.mark.parametrize("body", [True, False], ids=["bodies", "heads after a request"])
def test_half_requests_close_the_page_for_nobody(address: str, *, body: bool) -> None:
    with half_requests(address, 250, body=body):
        wait_until(lambda: ask(address, "/favicon.ico")[0] == 200, "the page answers others")


def test_a_request_that_is_too_long_is_refused_at_any_address(address: str) -> None:
    for path in ("/login", "/logout", "/nothing"):
        status, headers, text = ask(address, path, FORM, "x" * 100_000)
        assert (status, headers["connection"]) == (413, "close")
        assert text == "a request may have at most 65536 bytes"


@pytest.mark.parametrize("origin", ["http://[", "http://[::1", "://", "http:", "["])
def test_an_origin_that_is_none_is_refused(address: str, origin: str) -> None:
    assert ask(address, "/login", {**FORM, "Origin": origin}, form())[0] == 403


def test_a_form_of_many_fields_is_refused(address: str) -> None:
    assert ask(address, "/login", FORM, "a=1&" * 30)[0] == 403


def test_a_file_whose_name_is_no_text_is_listed_and_named(tab: Page, address: str) -> None:
    tab.goto(f"{address}incidents")
    tab.get_by_text("caf\\udce9.mcap: unprintable name; rename the file to open it here").wait_for()
    tab.get_by_role("link", name="ride.mcap").wait_for()


def test_a_device_with_a_slash_in_its_name_has_its_own_page(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    graph.lift("Tower/A", "L2")
    tab.goto(address)
    until(lambda: "L2" in card(tab, "Tower/A"), "the lift")
    tab.get_by_role("link", name="Tower/A").click()
    until(lambda: tab.url.endswith("/lift/Tower%2FA"), "its page")
    until(lambda: "Tower/A" in tab.locator("#main").inner_text(), "its card there")


def test_frames_of_no_browser_fill_no_log(address: str, said: Path) -> None:
    before = said.read_text().count("\n")
    assert strange_frames(address, random.Random(7), 100) > 50
    told = said.read_text()
    assert "Traceback" not in told
    assert "\x1b" not in told
    assert told.count("\n") - before < 12
    assert ask(address, "/favicon.ico")[0] == 200


def test_names_of_any_length_fill_no_memory_and_the_page_says_so(
    tab: Page, address: str, graph: Graph, until: Until
) -> None:
    pid = page_pid(address)
    tab.goto(address)
    forging = chain(
        long_names(graph._transport, 10, MB - 1000), long_names(graph._transport, 10_000)
    )
    peak, said_at = 0.0, 0.0

    def told() -> bool:
        nonlocal peak, said_at
        if time.monotonic() - said_at > 0.5:
            said_at = time.monotonic()
            next(forging)
        peak = max(peak, rss_mb(pid))
        return "are shown in part" in tab.locator("#status").inner_text()

    until(told, "the page to say so")
    for _ in range(20):
        told()
        tab.wait_for_timeout(500)
    assert tab.locator("article.lift", has_text="xxx").count() == 23
    assert peak < MOST_MB
