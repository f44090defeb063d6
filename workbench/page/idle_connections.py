"""Find connections that have sent no request for too long."""

from collections.abc import Hashable, Iterable
from typing import Final

MOST_SILENT_S: Final = 10.0
"""Time limit (s) for a connection to send its next request's whole head. The web server has no
such limit."""


class Silent:
    """Connections without a request, and the time since when."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def too_long(self, there: Iterable[Hashable], now: float) -> list[Hashable]:
        """Return the connections that have sent no request for longer than MOST_SILENT_S.

        `there`: all present connections; others are forgotten."""
        self._since = {one: self._since.get(one, now) for one in there}
        return [one for one, since in self._since.items() if now - since > MOST_SILENT_S]
