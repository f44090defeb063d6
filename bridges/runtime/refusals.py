"""Counts refused requests by reason, and logs the first refusal for each reason."""

import logging
import threading
from collections import Counter

from bridges.kinds.shared.decision import EXPECTED
from bridges.system.log import pairs

log = logging.getLogger(__name__)


class Refusals:
    """The refusals of one device or node, by reason."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def add(self, kind: str, detail: object, **whose: str) -> None:
        """Count one refusal. Any thread may call this method."""
        with self._lock:
            self._counts[kind] += 1
            first = self._counts[kind] == 1
        if first:
            level = logging.INFO if kind in EXPECTED else logging.WARNING
            log.log(level, pairs("refused", **whose, kind=kind, detail=detail))

    def counts(self) -> dict[str, int]:
        """Return the number of refusals by reason."""
        with self._lock:
            return dict(self._counts)
