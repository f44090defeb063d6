"""Counts of one device's scans and relays since the daemon's start, for monitoring."""

from collections import Counter
from typing import Any

import msgspec

COUNTS = "counts"
"""The key of the counts in the status file. Counts are not published on /diagnostics, because they
change all the time."""


class ScanCounts:
    """The counts of one device. The device's own thread changes the counts, and the main thread reads
    them."""

    def __init__(self) -> None:
        self._scans = self._failed = 0
        self._spent_s = self._longest_s = 0.0
        self._switched_on = Counter[str]()
        self._outputs: dict[str, object] = {}
        self._last: object = None

    def scanned(self, took_s: float, outputs: object, *, failed: bool) -> None:
        """Count a scan that took `took_s` (s), and the outputs that its decision switched on."""
        self._scans += 1
        self._failed += failed
        self._spent_s += took_s
        self._longest_s = max(self._longest_s, took_s)
        if outputs != self._last:
            self._last = outputs
            self._switch(msgspec.structs.asdict(outputs))  # type: ignore[arg-type]

    def status(self) -> dict[str, Any]:
        """Return the counts. `longest_scan_s` is the longest scan since the last call of this
        method."""
        longest_s, self._longest_s = self._longest_s, 0.0
        return {
            "scans": self._scans,
            "failed_scans": self._failed,
            "scan_seconds": round(self._spent_s, 3),
            "longest_scan_s": round(longest_s, 4),
            "switched_on": dict(self._switched_on),
        }

    def _switch(self, outputs: dict[str, object]) -> None:
        """Count each output that was switched on. In a group of outputs, also count a change to another
        output.

        Only outputs that are switched on or off count. The numbers of a charger's orders do not count,
        because they switch no relay.
        """
        for name, value in outputs.items():
            if value and isinstance(value, bool | str) and value != self._outputs.get(name):
                self._switched_on[name if value is True else f"{name} {value}"] += 1
        self._outputs = outputs
