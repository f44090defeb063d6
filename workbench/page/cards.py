"""The site in browsers: each card is drawn once, when it changes, for all of them.

The changes of a turn go to each browser as one script, made once: with an update for each card, a
browser could not keep up with 300 of them in a second.
"""

import json
import time
from collections.abc import Callable, Iterable, Mapping
from html import escape
from typing import Final, Protocol

from bridges.observe.limits import MOST_DEVICES, SILENT_S
from workbench.page import drawing
from workbench.page.listener import Listener
from workbench.page.live_site import DeviceView, LiveSite

AGES_S: Final = 1.0
"""Seconds between drawings of ages and silences, which change by themselves."""
Key = tuple[str, str]
"""A device's kind, and its name as it is shown."""


STATUS: Final = "status"
ROBOTS: Final = "robots"


def place_of(key: Key) -> str:
    """The id of the element that holds this card."""
    return f"card{drawing.path_of(*key)}"


def script(changed: Mapping[str, str]) -> str:
    """Return JavaScript that redraws these elements. `changed`: id -> content."""
    return (
        f"for (const [id, html] of Object.entries({json.dumps(changed)}))"
        " { const place = document.getElementById(id); if (place) place.innerHTML = html; }"
    )


class Wall(Protocol):
    """One browser's view of the site."""

    def change(self, script: str) -> None:
        """Show a change, by this script."""

    def rebuild(self) -> None:
        """Draw everything again: cards were added or removed."""


class Cards:
    """The cards, and the walls that show them."""

    def __init__(
        self, site: LiveSite, listener: Listener, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.cards: dict[Key, str] = {}
        self.shown: dict[Key, DeviceView] = {}
        self.walls: list[Wall] = []
        self._site = site
        self._listener = listener
        self._clock = clock
        self._aged_at = float("-inf")

    def turn(self) -> None:
        """Take the messages heard, and draw the changes."""
        heard = self._listener.turn()
        now = self._clock()
        changed: dict[str, str] = {}
        if now - self._aged_at >= AGES_S:
            self._aged_at = now
            changed = self._draw(self._site.devices(now, time.time()))
            self._drop()
            changed |= {STATUS: self.status(), ROBOTS: self.robots()}
        elif heard:
            changed = self._draw(self._site.changed(now, time.time()))
        if changed:
            told = script(changed)
            for wall in self.walls:
                wall.change(told)

    def status(self) -> str:
        """Return the numbers of heard devices and of those that need attention, as one line."""
        told = " · ".join(self._told())
        return f'<p class="status" role="status">{told}</p>'

    def robots(self) -> str:
        """Draw the robots that fleets report."""
        return drawing.robots(self._site.robots(), self._clock())

    def _told(self) -> Iterable[str]:
        yield f"{len(self.shown)} shown"
        if wrong := sum(one.row.wrong for one in self.shown.values()):
            yield _wrong(f"{wrong} {'needs' if wrong == 1 else 'need'} attention")
        heard_at, trouble = self._site.heard_at, self._listener.trouble
        if trouble:
            yield _wrong(trouble)
        elif heard_at is None:
            yield "nothing heard yet: check the domain and the network"
        elif (silent_s := self._clock() - heard_at) > SILENT_S:
            yield _wrong(f"nothing was heard for {silent_s:.0f} s")
        for kind in sorted(self._site.crowded):
            yield f"more than {MOST_DEVICES} {kind}s are on the graph: some are not shown"
        if self._listener.lost:
            yield f"{self._listener.lost} messages came too fast and were lost"
        if self._listener.cut:
            yield f"{self._listener.cut} messages were too long and are shown in part"

    def _draw(self, every: Iterable[DeviceView]) -> dict[str, str]:
        """Draw the changed cards; return them by place."""
        changed, added = {}, False
        for shown in every:
            key = (shown.row.kind, shown.row.name)
            html = drawing.card(shown, before=self.shown.get(key))
            self.shown[key] = shown
            if self.cards.get(key) == html:
                continue
            added = added or key not in self.cards
            self.cards[key] = changed[place_of(key)] = html
        if added:
            self._rebuild()
        return changed

    def _drop(self) -> None:
        gone = [key for key in self.cards if not self._site.knows(*key)]
        for key in gone:
            del self.cards[key], self.shown[key]
        if gone:
            self._rebuild()

    def _rebuild(self) -> None:
        for wall in self.walls:
            wall.rebuild()


def _wrong(text: str) -> str:
    return f'<span class="wrong">✖ {escape(text)}</span>'
