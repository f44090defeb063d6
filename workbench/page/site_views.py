"""The views of a live site. One view shows the whole site. Another view shows one device with its
timeline, explanation and wiring."""

import json
import time
from collections.abc import Callable, Sequence
from datetime import tzinfo
from functools import partial
from html import escape
from typing import Final

from fastapi import Request, Response
from nicegui import Client, ui

from bridges.messages.words import KINDS
from bridges.runtime import faults
from workbench.explain.explanation import Explanation
from workbench.explain.picture import svg
from workbench.page import tables
from workbench.page.actions import Deeds
from workbench.page.buttons import Buttons
from workbench.page.cards import AGES_S, ROBOTS, STANDING, STATUS, WRONG, Cards, Key, Wall, place_of
from workbench.page.drawing import linked, path_of
from workbench.page.explanation_html import explanation, story
from workbench.page.head import head, main, part
from workbench.page.live_site import LiveSite
from workbench.page.local_daemons import LocalDaemons
from workbench.page.login import Login
from workbench.page.tab import Tab

SECTIONS: Final = (
    ("lift", "Lifts"),
    ("door", "Doors"),
    ("charger", "Chargers"),
    ("alarm", "Alarms"),
    ("dispenser", "Dispensers"),
    ("ingestor", "Ingestors"),
    ("coordinator", "Charger coordinators"),
    ("robot", "Robots"),
)
WIDE: Final = "panel wide-part"
FEW: Final = 8
"""Maximum number of devices in a section that takes half the page's width. A larger section takes the
whole width."""
LOST: Final = '<p id="lost" role="alert"></p>'
"""The element in which the browser tells that the page's server is silent."""
FILTERS: Final = (
    '<div class="filters"><label>Find a device <input id="find" type="search"></label>'
    '<label><input id="only" type="checkbox"> Only what needs attention</label></div>'
)
NOT_HERE: Final = (
    "The device's daemon is not on this machine, or the page's user may not see the daemon. Or two"
    " daemons here have a device of this name. To see wiring, limits and live levels, open a page on"
    " the daemon's own machine."
)


class SiteWall(Tab):
    """One browser's view of the site. The view has few NiceGUI elements, because the browser visits
    every such element at each update."""

    def __init__(self, cards: Cards, client: Client) -> None:
        super().__init__(client)
        self._cards = cards
        self._missed = False
        self._built = 0
        part(f'<div id="{STATUS}">{cards.parts[STATUS]}</div>{LOST}{FILTERS}')
        part(f'<div id="{STANDING}">{cards.parts[STANDING]}</div>')
        part(f'<div id="{WRONG}">{cards.parts[WRONG]}</div>')
        self._box = part()
        part(f'<div id="{ROBOTS}">{cards.parts[ROBOTS]}</div>')
        self.rebuild()

    def change(self, script: str) -> None:
        """Send a change. If the browser is disconnected, remember that it needs all cards when it
        returns."""
        if not self.is_here:
            self._missed = True
        elif not self._missed:
            self.run(script)

    def answer(self, wrong: int) -> None:
        """Answer the browser's question. First send all cards if the browser has missed a change.
        Otherwise it would wait for the next change of the site."""
        if self._missed and self.is_here:
            self.rebuild()
        super().answer(wrong)

    def rebuild(self) -> None:
        """Draw all cards, by kind and name."""
        self._missed = not self.is_here
        self._built += 1  # equal content is not sent, so a new number makes it differ
        html = "".join(self._section(*section) for section in SECTIONS)
        none = "<p>No device is shown.</p>"
        self._box.set_content(
            f'<div class="sections" data-built="{self._built}">{html or none}</div>'
        )
        self.run(f"show({json.dumps(self._cards.parts)})")

    def _section(self, kind: str, title: str) -> str:
        keys = sorted(key for key in self._cards.cards if key[0] == kind)
        cards = f'<div class="cards">{"".join(map(self._slot, keys))}</div>'
        many = ' class="many"' if len(keys) > FEW else ""
        return f"<section{many}><h2>{title}</h2>{cards}</section>" if keys else ""

    def _slot(self, key: Key) -> str:
        """Make the slot (the HTML around a card). The link is outside the card, which is redrawn, so
        the link keeps the keyboard's focus."""
        card = f'<div id="{place_of(key)}">{self._cards.cards[key]}</div>'
        name, path = escape(key[1]), path_of(*key)
        link = f'<a class="cover" href="{path}" aria-label="{name}"></a>' if linked(key[0]) else ""
        return f'<div class="slot" data-find="{name.lower()}">{card}{link}</div>'


class SiteViews:
    """The views of the site and of its devices."""

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
        """Register the views' addresses."""
        ui.page("/", title="Site")(self.site)
        for kind in (*KINDS, "robot"):
            ui.page(f"/{kind}/{{name:path}}", title="Device")(partial(self.device, kind))

    def site(self, request: Request, client: Client) -> None:
        """Show the whole site as a wall of cards."""
        head("Site", self._login, request)
        with main():
            self._join(SiteWall(self._cards, client), client)

    def _join(self, wall: Wall, client: Client) -> None:
        self._cards.walls.append(wall)
        client.on_delete(lambda: self._cards.walls.remove(wall))

    def device(self, kind: str, name: str, request: Request, client: Client) -> Response | None:
        """Show one device."""
        head(name, self._login, request)
        key = (kind, name)
        with main("device"):
            if key in self._cards.shown:
                self._parts(key, request, client)
                return None
            part(f"<p>{escape(f'No {kind} named {name} was heard.')}</p>", WIDE)

            def look() -> None:
                if key in self._cards.shown:
                    ui.navigate.reload()

            ui.timer(AGES_S, look)
        return client.build_response(request, 404)

    def _parts(self, key: Key, request: Request, client: Client) -> None:
        """Fill the view of a device. The caller has checked that the device was heard."""
        tab = Tab(client)
        self._join(tab, client)
        drawn: dict[str, Callable[[], str]] = {}

        def place(name: str, draw: Callable[[], str]) -> None:
            drawn[name] = draw
            part(f'<div id="{name}">{draw()}</div>')

        part(LOST, "wide-part")
        place("card", lambda: self._card(key))
        with ui.element("section").classes("panel why"):
            place("why", lambda: self._why(key, tab.zone))
            if key[0] in KINDS:
                with ui.element("details"):
                    part("What happened").props("tag=summary")
                    place("story", lambda: self._story(key, tab.zone))
        self._buttons.show(key, request, tab)
        if key[0] in KINDS:
            with ui.element("section").classes(WIDE):
                part("<h2>Last ten minutes</h2>")
                with ui.element("div").classes("timeline") as scrolls:
                    scrolls.props('tabindex=0 role=region aria-label="Timeline"')
                    place("timeline", lambda: self._timeline(key, tab.zone))
        with ui.element("details").classes(f"{WIDE} wiring"):
            part("<h2>Wiring and limits</h2>").props("tag=summary")
            with ui.element("div").classes("columns"):
                place("levels", lambda: self._levels(key))
                place("wiring", lambda: self._wiring(key))

        def refresh() -> None:
            for name, draw in drawn.items():
                tab.show(name, draw())

        ui.timer(AGES_S, refresh)

    def _card(self, key: Key) -> str:
        return self._cards.cards.get(key, "<p>The device is no longer heard.</p>")

    def _why(self, key: Key, zone: tzinfo | None) -> str:
        found = self._explained(key, zone)
        return f"<h2>Why</h2>{explanation(found)}" if found else ""

    def _story(self, key: Key, zone: tzinfo | None) -> str:
        found = self._explained(key, zone)
        return story(found, zone) if found else ""

    def _explained(self, key: Key, zone: tzinfo | None) -> Explanation | None:
        now, wall = time.monotonic(), time.time()
        return self._site.explain(*key, now, wall, self._remedies, zone)

    def _timeline(self, key: Key, zone: tzinfo | None) -> str:
        found = self._site.timeline(*key, time.monotonic())
        return svg(found, zone=zone) if found else ""

    def _levels(self, key: Key) -> str:
        served = self._here.serving(key)
        return tables.levels(served.sensed, served.driven) if served else ""

    def _wiring(self, key: Key) -> str:
        served = self._here.serving(key)
        if served is None or not served.local.file:
            return f"<p>{NOT_HERE}</p>"
        return tables.wiring(served.local.file, served.device, served.contacts)
