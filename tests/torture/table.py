"""What was injected, how often, and what happened."""

import threading
from collections import Counter


class Table:
    """What was injected and what happened, counted by several threads."""

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, str]] = Counter()
        self._lock = threading.Lock()

    def count(self, injected: str, happened: str, times: int = 1) -> None:
        """Count it once, or so many times."""
        with self._lock:
            self._counts[injected, happened] += times

    def __str__(self) -> str:
        rows = [f"| {what} | {n} | {then} |" for (what, then), n in sorted(self._counts.items())]
        return "\n".join(["| injected | times | what happened |", "|---|---|---|", *rows])
