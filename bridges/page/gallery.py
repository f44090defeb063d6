"""What every browser is shown of the site: each card drawn once, when it changes, for all of them."""

import time
from collections.abc import Callable, Iterable
from html import escape
from typing import Final, Protocol

from bridges.page import drawing
from bridges.page.listener import Listener
from bridges.page.site import MOST_DEVICES, Shown, Site

AGES_S: Final = 1.0
"""How often what changes by itself is drawn again: ages, silence."""
SILENT_S: Final = 3.0
Key = tuple[str, str]
"""A device's kind, and its name as it is shown."""


class Wall(Protocol):
    """One browser's view of the site."""

    def change(self, key: Key, html: str) -> None:
        """This card is another now."""

    def rebuild(self) -> None:
        """Cards were added, or have gone."""

    def tell(self, status: str, robots: str) -> None:
        """The lines that change each second."""


class Gallery:
    """The cards, and the walls that they hang on."""

    def __init__(
        self, site: Site, listener: Listener, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.cards: dict[Key, str] = {}
        self.shown: dict[Key, Shown] = {}
        self.walls: list[Wall] = []
        self._site = site
        self._listener = listener
        self._clock = clock
        self._aged_at = float("-inf")

    def turn(self) -> None:
        """Take what was heard, and draw what has changed by it, or by time."""
        heard = self._listener.turn()
        now = self._clock()
        if now - self._aged_at >= AGES_S:
            self._aged_at = now
            self._draw(self._site.devices(now, time.time()))
            self._drop()
            status, robots = self.status(), self.robots()
            for wall in self.walls:
                wall.tell(status, robots)
        elif heard:
            self._draw(self._site.changed(now, time.time()))

    def status(self) -> str:
        """One line: what is heard, and what needs attention."""
        told = " · ".join(self._told())
        return f'<p class="status" role="status">{told}</p>'

    def robots(self) -> str:
        """The robots that fleets report."""
        return drawing.robots(self._site.robots(), self._clock())

    def _told(self) -> Iterable[str]:
        yield f"{len(self.shown)} shown"
        if wrong := sum(one.row.wrong for one in self.shown.values()):
            yield _wrong(f"{wrong} {'needs' if wrong == 1 else 'need'} attention")
        heard_at, trouble = self._site.heard_at, self._listener.trouble
        if trouble:
            yield _wrong(trouble)
        elif heard_at is None:
            yield "nothing was heard yet: check the domain and the network"
        elif (silent_s := self._clock() - heard_at) > SILENT_S:
            yield _wrong(f"nothing was heard for {silent_s:.0f} s")
        for kind in sorted(self._site.crowded):
            yield f"more than {MOST_DEVICES} {kind}s are on the graph: some are not shown"
        if self._listener.lost:
            yield f"{self._listener.lost} messages came too fast, and were lost"

    def _draw(self, every: Iterable[Shown]) -> None:
        added = False
        for shown in every:
            key = (shown.row.kind, shown.row.name)
            html = drawing.card(shown, before=self.shown.get(key))
            self.shown[key] = shown
            if self.cards.get(key) == html:
                continue
            added = added or key not in self.cards
            self.cards[key] = html
            for wall in self.walls:
                wall.change(key, html)
        if added:
            self._rebuild()

    def _drop(self) -> None:
        gone = [key for key in self.cards if not self._site.knows(*key)]
        for key in gone:
            del self.cards[key], self.shown[key]
        if gone:
            self._rebuild()

    def _rebuild(self) -> None:
        for wall in list(self.walls):
            wall.rebuild()


def _wrong(text: str) -> str:
    return f'<span class="wrong">✖ {escape(text)}</span>'
