"""What was not obeyed: counted by its kind, and the first of each kind logged."""

import logging
import threading
from collections import Counter

from bridges.log import pairs

log = logging.getLogger(__name__)


class Refusals:
    """Those of one device, or of one node."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def add(self, kind: str, detail: object, **whose: str) -> None:
        """One more, from any thread."""
        with self._lock:
            self._counts[kind] += 1
            first = self._counts[kind] == 1
        if first:
            log.warning(pairs("refused", **whose, kind=kind, detail=detail))

    def counts(self) -> dict[str, int]:
        """Kind -> how many."""
        with self._lock:
            return dict(self._counts)
