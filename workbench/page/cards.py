"""The site's cards (one card for each device), as all browsers show them. A changed card is drawn once,
and all browsers get that drawing.

In each turn, all browsers get the same script with all changes. With a script for each card, a browser
could not keep up with 300 changes in a second.
"""

import json
import time
from collections.abc import Callable, Container, Iterable, Mapping
from html import escape
from typing import Final, Protocol

from bridges.messages.words import printable
from bridges.observe.limits import MOST_DEVICES, SILENT_S
from bridges.runtime import faults
from workbench.page import drawing
from workbench.page.listener import Listener
from workbench.page.live_site import DeviceView, LiveSite

AGES_S: Final = 1.0
"""Time (s) after which ages and silences are drawn again. They change even if no message comes."""
Key = tuple[str, str]
"""A device's kind, and the device's name in a printable form."""


STATUS: Final = "status"
WRONG: Final = "wrong"
ROBOTS: Final = "robots"
STANDING: Final = "standing"


def place_of(key: Key) -> str:
    """Return the id of the element that holds this card."""
    return f"card{drawing.path_of(*key)}"


def script(changed: Mapping[str, str]) -> str:
    """Return JavaScript that redraws these elements. `changed` is element id -> content."""
    return f"show({json.dumps(changed)})"


class Wall(Protocol):
    """One browser's view of the site, which is kept up to date."""

    def change(self, script: str) -> None:
        """Run this script, which shows a change of the site."""

    def rebuild(self) -> None:
        """Draw all cards again, because a device was added or dropped."""

    def answer(self, wrong: int) -> None:
        """Answer the browser's last question. The answer tells the browser that it has got everything
        that was heard before the question.

        `wrong` is the number of devices that need attention.
        """


class Cards:
    """All cards, and the browsers that show the cards.

    `parts` is the content of everything except the cards, by element id, as the browsers got it last. A
    browser that connects gets the same content, because later changes are found by comparison with
    it.
    """

    def __init__(
        self, site: LiveSite, listener: Listener, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.cards: dict[Key, str] = {}
        self.shown: dict[Key, DeviceView] = {}
        self.walls: list[Wall] = []
        self.wrong = 0
        self._site = site
        self._listener = listener
        self._clock = clock
        self._aged_at = float("-inf")
        self._failed = False
        self._car_places: dict[Key, float | None] = {}
        self._remedies = faults.for_explain()
        self.parts = self._drawn_parts()

    def turn(self) -> None:
        """Take the messages that have arrived, and draw the changes. After a turn that has failed, draw
        everything, because the browsers may have missed a change."""
        again, self._failed = self._failed, True
        heard = self._listener.turn()
        now = self._clock()
        changed: dict[str, str] = {}
        if now - self._aged_at >= AGES_S:
            self._aged_at = now
            every = self._site.devices(now, time.time())
            self._drop({(one.row.kind, one.row.name) for one in every})
            changed = self._draw(every)
        elif heard:
            changed = self._draw(self._site.changed(now, time.time()))
        if changed or self._aged_at == now:
            changed |= self._changed_parts()
        if changed:
            told = script(changed)
            for wall in self.walls:
                wall.change(told)
        if again:
            self._rebuild()
        self._failed = False
        for wall in self.walls:
            wall.answer(self.wrong)

    def _changed_parts(self) -> dict[str, str]:
        self.wrong = sum(one.row.wrong for one in self.shown.values())
        before, self.parts = self.parts, self._drawn_parts()
        return {place: html for place, html in self.parts.items() if before[place] != html}

    def _drawn_parts(self) -> dict[str, str]:
        return {
            STATUS: self._status(),
            STANDING: drawing.standing(self._site.alarms()),
            WRONG: self._attention(),
            ROBOTS: self._robots(),
        }

    def _attention(self) -> str:
        """List the devices that need attention, each with its trouble and the remedy."""
        wrong = [self.shown[key] for key in sorted(self.shown) if self.shown[key].row.wrong]
        return drawing.attention(wrong, self._remedies)

    def _status(self) -> str:
        """Return one line with the number of devices heard, and the number of devices that need
        attention."""
        told = " · ".join(self._told())
        return f'<p class="status" role="status">{told}</p>'

    def _robots(self) -> str:
        """Draw the robots that fleets report, except robots that have a card."""
        own = {
            name
            for (kind, name), one in self.shown.items()
            if kind == "robot" and one.row.age != "-"
        }
        every = self._site.robots()
        others = [one for one in every if printable(f"{one.fleet}/{one.state.name}") not in own]
        return drawing.robots(others, self._clock())

    def _told(self) -> Iterable[str]:
        yield f"{len(self.shown)} shown"
        if self.wrong:
            yield _wrong(f"{self.wrong} {'needs' if self.wrong == 1 else 'need'} attention")
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
            yield f"{self._listener.lost} messages came too fast, so the page lost them"
        if self._listener.cut:
            yield f"{self._listener.cut} messages were too long and are shown in part"

    def _draw(self, every: Iterable[DeviceView]) -> dict[str, str]:
        """Draw the changed cards. Return element id -> content."""
        changed, added = {}, False
        for shown in every:
            key = (shown.row.kind, shown.row.name)
            left = self._car_places.get(key)
            html = drawing.card(shown, left)
            self.shown[key], self._car_places[key] = shown, drawing.car_place(shown.state, left)
            if self.cards.get(key) == html:
                continue
            added = added or key not in self.cards
            self.cards[key] = changed[place_of(key)] = html
        if added:
            self._rebuild()
        return changed

    def _drop(self, known: Container[Key]) -> None:
        """Drop every device that the site no longer knows."""
        gone = [key for key in self.cards if key not in known]
        for key in gone:
            del self.cards[key], self.shown[key], self._car_places[key]
        if gone:
            self._rebuild()

    def _rebuild(self) -> None:
        for wall in self.walls:
            wall.rebuild()


def _wrong(text: str) -> str:
    return f'<span class="wrong">✖ {escape(text)}</span>'
