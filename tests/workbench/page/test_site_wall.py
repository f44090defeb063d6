"""A browser's view of the site, from the time before the browser has connected."""

from typing import Any

import pytest
from nicegui import Client
from nicegui.page import page

from tests.workbench.page.test_cards import nowhere
from workbench.page.cards import Cards
from workbench.page.listener import Listener
from workbench.page.live_site import LiveSite
from workbench.page.site_views import SiteWall


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the list of scripts that the browser gets."""
    found: list[str] = []

    def run(client: Client, code: str, **more: Any) -> None:
        found.append(code)

    monkeypatch.setattr(Client, "run_javascript", run)
    return found


def test_a_browser_that_connects_gets_a_change_that_came_before_and_was_the_last_one(
    ran: list[str],
) -> None:
    site = LiveSite()
    client = Client(page(""))
    with client:
        wall = SiteWall(Cards(site, Listener(site, nowhere)), client)
    ran.clear()
    wall.change('show({"standing": "a drill"})')
    wall.answer(0)
    assert ran == []  # because the browser has not yet loaded the page
    client.tab_id = "a tab"
    wall.answer(0)
    assert [script.split(":")[0] for script in ran] == ['show({"status"']
    ran.clear()
    wall.answer(0)
    wall.change('show({"standing": ""})')
    assert ran == ['show({"standing": ""})']
