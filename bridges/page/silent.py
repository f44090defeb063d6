"""Which connections have asked for nothing for too long."""

from collections.abc import Hashable, Iterable
from typing import Final

MOST_SILENT_S: Final = 10.0
"""Until the first request has come whole. The web server itself waits for ever."""


class Silent:
    """Since when each of them has asked for nothing."""

    def __init__(self) -> None:
        self._since: dict[Hashable, float] = {}

    def too_long(self, there: Iterable[Hashable], now: float) -> list[Hashable]:
        """Those of `there` that have done so for more than MOST_SILENT_S. Others are forgotten."""
        self._since = {one: self._since.get(one, now) for one in there}
        return [one for one, since in self._since.items() if now - since > MOST_SILENT_S]
