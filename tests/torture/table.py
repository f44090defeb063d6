"""The table of the torture: each disturbance, its count, and its result."""

import threading
from collections import Counter


class Table:
    """A table of counts for disturbances and results. Several threads may count."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, str]] = Counter()
        self._lock = threading.Lock()

    def count(self, injected: str, happened: str, times: int = 1) -> None:
        """Add `times` to the count of this disturbance with this result."""
        with self._lock:
            self._counts[injected, happened] += times

    def __str__(self) -> str:
        rows = [f"| {what} | {n} | {then} |" for (what, then), n in sorted(self._counts.items())]
        return "\n".join(["| injected | times | what happened |", "|---|---|---|", *rows])
