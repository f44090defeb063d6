"""A browser's view of the site, from the time before the browser has connected."""

import json
from functools import partial
from itertools import product
from typing import Any

import pytest
from nicegui import Client
from nicegui.page import page

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.page.test_cards import nowhere
from tests.workbench.page.test_live_site import heard, lift
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


STEPS = ("alarm", "end", "connect", "leave", "a second passes")


@pytest.mark.parametrize("first", STEPS)
def test_after_a_second_a_connected_browser_shows_what_is_true(ran: list[str], first: str) -> None:
    for others in product(STEPS, repeat=3):
        now, site, client = [100.0], LiveSite(), Client(page(""))
        listener = Listener(site, nowhere)
        cards = Cards(site, listener, partial(now.__getitem__, 0))
        listener.hear(lift(now[0]))
        cards.turn()
        with client:
            cards.walls.append(SiteWall(cards, client))
        screen: dict[str, str] = {}
        steps = (first, *others, "connect", "a second passes")
        for step in steps:
            now[0] += 1.0 if step == "a second passes" else 0.1
            if step in ("alarm", "end"):
                told = d.Bool(step == "alarm")
                listener.hear(heard(now[0], topics.FIRE_ALARM_TRIGGER, told))
            elif step in ("connect", "leave"):
                client.tab_id = "a tab" if step == "connect" else None
            listener.hear(lift(now[0]))
            cards.turn()
            for script in ran:  # a browser that has left gets them when it returns
                screen |= json.loads(script.removeprefix("show(").removesuffix(")"))
            ran.clear()
        alarm = [step for step in steps if step in ("alarm", "end")][-1:] == ["alarm"]
        assert ("published an alarm" in screen["standing"]) == alarm, steps
