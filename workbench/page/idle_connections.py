"""Find connections that have sent no request for too long."""

from collections.abc import Hashable, Iterable
from typing import Final

MOST_SILENT_S: Final = 10.0
"""Time limit (s) for a connection to send its next request's whole head. The web server itself has
none."""


class Silent:
    """Connection -> time since which it has sent no request."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def too_long(self, there: Iterable[Hashable], now: float) -> list[Hashable]:
        """Return those of `there` that have sent none for longer than MOST_SILENT_S. Forget all
        others."""
        self._since = {one: self._since.get(one, now) for one in there}
        return [one for one, since in self._since.items() if now - since > MOST_SILENT_S]
