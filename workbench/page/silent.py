"""Which connections have sent no request for too long."""

from collections.abc import Hashable, Iterable
from typing import Final

MOST_SILENT_S: Final = 10.0
"""How long (s) a connection may take to send its next request's whole head. The web server itself waits
for ever."""


class Silent:
    """Since when each connection has sent no request."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def too_long(self, there: Iterable[Hashable], now: float) -> list[Hashable]:
        """Those of `there` that have sent none for longer than MOST_SILENT_S. All others are
        forgotten."""
        self._since = {one: self._since.get(one, now) for one in there}
        return [one for one, since in self._since.items() if now - since > MOST_SILENT_S]
