"""One browser's tab. A tab has a time zone, asks again and again for the latest changes, and gets the
changes of its view."""

import json
import math
import re
from collections.abc import Sequence
from datetime import tzinfo
from difflib import SequenceMatcher
from typing import Final

from nicegui import Client, ui
from nicegui.events import GenericEventArguments

from workbench.page.zone import zone_of

PIECE: Final = re.compile(r"(?=<(?:rect|text|line|path|tr|p|li)\b)|(?<=\n)")
"""Places at which a view's HTML is cut into pieces. The page sends only changed pieces to the
browser."""
WHOLE: Final = 1_000_000
"""A number greater than the number of pieces in any part."""

Edit = tuple[int, int, Sequence[str]]
"""An edit: the number of the first piece that is replaced, the number of the first piece after the
replaced pieces, and the new pieces."""


def edits(before: Sequence[str], after: Sequence[str]) -> list[Edit]:
    """Return the edits that turn `before` into `after`. The last edit comes first."""
    found = SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
    return [(i, j, after[m:n]) for what, i, j, m, n in reversed(found) if what != "equal"]


class Tab:
    """A client's tab. `zone` is the browser's time zone, or None until the browser has named its
    zone."""

    def __init__(self, client: Client) -> None:
        self.zone: tzinfo | None = None
        self._client = client
        self._asked: float | None = None
        self._sent: dict[str, list[str]] = {}
        ui.on("ask", self._ask)

    @property
    def is_here(self) -> bool:
        """Return whether the browser is connected."""
        return self._client.has_socket_connection

    def run(self, script: str) -> None:
        """Run JavaScript in the browser."""
        self._client.run_javascript(script)

    def show(self, place: str, html: str) -> None:
        """Send the changes of this part. If the browser was away, send the whole part."""
        if not self.is_here:
            self._sent.clear()
            return
        pieces = PIECE.split(html)
        before = self._sent.get(place)
        changed = [(0, WHOLE, pieces)] if before is None else edits(before, pieces)
        if changed:
            self._sent[place] = pieces
            self.run(f"patch({json.dumps(place)}, {json.dumps(changed)})")

    def change(self, script: str) -> None:
        """Ignore a change of the site, because a device's view draws only its device."""

    def rebuild(self) -> None:
        """Do nothing, because a device's view has no cards."""

    def answer(self, wrong: int) -> None:
        """Answer the browser's question. The answer tells the browser that it has got everything that
        was heard before the question.

        `wrong` is the number of devices that need attention.
        """
        asked, self._asked = self._asked, None
        if asked is not None and self.is_here:
            self.run(f"fresh({asked}, {wrong})")

    def _ask(self, event: GenericEventArguments) -> None:
        """Take the browser's question. It contains the browser's steady clock, which the answer
        repeats, and the browser's time zone."""
        match event.args:
            case [int() | float() as asked, str() as zone] if math.isfinite(asked):
                self._asked, self.zone = float(asked), zone_of(zone)
