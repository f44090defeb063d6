"""Find connections that have brought no request for too long."""

from collections.abc import Hashable, Iterable
from typing import Final

MOST_SILENT_S: Final = 10.0
"""Maximum time (s) for a connection to send the whole head of its next request. The web server itself
has no limit for this time."""


class Silent:
    """Connections without a request, each with the time at which its silence began."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def too_long(self, there: Iterable[Hashable], now: float) -> list[Hashable]:
        """Return the connections that have been silent for longer than MOST_SILENT_S.

        `there` has all present connections. All other connections are forgotten.
        """
        self._since = {one: self._since.get(one, now) for one in there}
        return [one for one, since in self._since.items() if now - since > MOST_SILENT_S]
