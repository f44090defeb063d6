"""The views of a live site: all of it, and one device with its timeline, its why and its wiring."""

import time
from collections.abc import Sequence
from functools import partial
from html import escape
from typing import Final

from fastapi import Request
from nicegui import Client, ui

from bridges.messages.words import KINDS
from bridges.runtime import faults
from workbench.explain.explanation import Explanation
from workbench.explain.picture import svg
from workbench.page import tables
from workbench.page.actions import Deeds
from workbench.page.buttons import Buttons
from workbench.page.cards import AGES_S, ROBOTS, STATUS, Cards, Key, place_of
from workbench.page.drawing import path_of
from workbench.page.explanation_html import explanation, story
from workbench.page.head import head, main, part
from workbench.page.live_site import LiveSite
from workbench.page.local_daemons import LocalDaemons
from workbench.page.login import Login

SECTIONS: Final = (
    ("lift", "Lifts"),
    ("door", "Doors"),
    ("charger", "Chargers"),
    ("coordinator", "Charger coordinators"),
    ("robot", "Charging schedule"),
)
WIDE: Final = "panel wide-part"
NOT_HERE: Final = (
    "Its daemon is not on this machine, or the page's user may not see it: wiring, limits and live"
    " levels are shown by a page on the daemon's own machine."
)


class SiteWall:
    """One browser's view of the site. It has few elements of the library, because a browser goes
    through all of them at each update."""

    def __init__(self, cards: Cards, client: Client) -> None:
        self._cards = cards
        self._client = client
        self._missed = False
        self._built = 0
        part(f'<div id="{STATUS}">{cards.status()}</div>')
        self._find = ui.input("Find a device").props("dense clearable").classes("find")
        self._box = part()
        part(f'<div id="{ROBOTS}">{cards.robots()}</div>')
        self._find.on_value_change(self.rebuild)
        self.rebuild()

    def change(self, script: str) -> None:
        """Send a change; skip a browser that is away: on its return all is rebuilt."""
        if not self._client.has_socket_connection:
            self._missed = True
        elif self._missed:
            self.rebuild()
        else:
            self._client.run_javascript(script)

    def rebuild(self) -> None:
        """Draw all cards that match the search, by kind and name."""
        self._missed = not self._client.has_socket_connection
        self._built += 1  # makes the content differ: equal content would not be sent
        wanted = str(self._find.value or "").lower()
        html = "".join(self._section(*section, wanted) for section in SECTIONS)
        none = "<p>No device is shown.</p>"
        self._box.set_content(f'<div data-built="{self._built}">{html or none}</div>')

    def _section(self, kind: str, title: str, wanted: str) -> str:
        keys = [key for key in self._cards.cards if key[0] == kind and wanted in key[1].lower()]
        slots = "".join(map(self._slot, sorted(keys)))
        return f'<h2>{title}</h2><div class="cards">{slots}</div>' if keys else ""

    def _slot(self, key: Key) -> str:
        """Make a card's slot. The link is outside the redrawn part, to keep the keyboard's focus."""
        card = f'<div id="{place_of(key)}">{self._cards.cards[key]}</div>'
        name, path = escape(key[1]), path_of(*key)
        link = f'<a class="cover" href="{path}" aria-label="{name}"></a>' if key[0] in KINDS else ""
        return f'<div class="slot">{card}{link}</div>'


class SiteViews:
    """The site and its devices."""

    def __init__(
        self,
        site: LiveSite,
        cards: Cards,
        here: LocalDaemons,
        login: Login,
        deeds: Deeds,
        graph: Sequence[str],
    ) -> None:
        self._site = site
        self._cards = cards
        self._here = here
        self._login = login
        self._buttons = Buttons(cards, here, login, deeds, graph)
        self._remedies = faults.for_explain()

    def install(self) -> None:
        """Put the views at their addresses."""
        ui.page("/", title="Site")(self.site)
        for kind in KINDS:
            ui.page(f"/{kind}/{{name:path}}", title="Device")(partial(self.device, kind))

    def site(self, request: Request, client: Client) -> None:
        """Show everything, as a wall of cards."""
        head("Site", self._login, request)
        with main():
            wall = SiteWall(self._cards, client)
        self._cards.walls.append(wall)
        client.on_delete(lambda: self._cards.walls.remove(wall))

    def device(self, kind: str, name: str, request: Request) -> None:
        """Show one device."""
        head(name, self._login, request)
        key = (kind, name)
        with main("device"):
            if key not in self._cards.shown:
                part(f"<p>{escape(f'No {kind} named {name} was heard.')}</p>", WIDE)

                def look() -> None:
                    if key in self._cards.shown:
                        ui.navigate.reload()

                ui.timer(AGES_S, look)
                return
            drawn = [(part(), self._card)]
            with ui.element("section").classes("panel"):
                drawn.append((part(), self._why))
                with ui.element("details"):
                    part("What happened").props("tag=summary")
                    drawn.append((part(), self._story))
            self._buttons.show(key, request)
            with ui.element("section").classes(WIDE):
                part("<h2>Last ten minutes</h2>")
                with ui.element("div").classes("timeline") as scrolls:
                    scrolls.props('tabindex=0 role=region aria-label="Timeline"')
                    drawn.append((part(), self._timeline))
            with ui.element("section").classes(WIDE):
                part("<h2>Wiring and limits</h2>")
                drawn += [(part(), self._levels), (part(), self._wiring)]

        def refresh() -> None:
            for place, draw in drawn:
                place.set_content(draw(key))

        refresh()
        ui.timer(AGES_S, refresh)

    def _card(self, key: Key) -> str:
        return self._cards.cards.get(key, "<p>It is no longer heard.</p>")

    def _why(self, key: Key) -> str:
        found = self._explained(key)
        return f"<h2>Why</h2>{explanation(found)}" if found else ""

    def _story(self, key: Key) -> str:
        found = self._explained(key)
        return story(found) if found else ""

    def _explained(self, key: Key) -> Explanation | None:
        return self._site.explain(*key, time.monotonic(), time.time(), self._remedies)

    def _timeline(self, key: Key) -> str:
        found = self._site.timeline(*key, time.monotonic())
        return svg(found) if found else ""

    def _levels(self, key: Key) -> str:
        served = self._here.served.get(key)
        return tables.levels(served.sensed, served.driven) if served else ""

    def _wiring(self, key: Key) -> str:
        served = self._here.served.get(key)
        if served is None or not served.local.file:
            return f"<p>{NOT_HERE}</p>"
        return tables.wiring(served.local.file, key[1], served.contacts)
