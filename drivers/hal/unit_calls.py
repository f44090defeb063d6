"""Counts of one bus's calls by unit since the daemon's start, for monitoring."""

from typing import Any, Final

from msgspec import Struct

UNITS_MAX: Final = 64
"""The maximum number of units that have counts of their own. Calls to further units share one count."""
OTHERS: Final = "other units"


class _Calls(Struct):
    calls: int = 0
    failed: int = 0
    spent_s: float = 0.0
    longest_s: float = 0.0


class UnitCalls:
    """The counts of calls to each unit. The bus's thread counts, and the thread that writes the status
    reads the counts.

    A unit's name comes from the YAML, never from the network.
    """

    def __init__(self) -> None:
        self._units: dict[str, _Calls] = {}

    def ended(self, unit: str, took_s: float, *, failed: bool) -> None:
        """Count a call that took `took_s` seconds. `failed` means that no reply came, or that the unit
        refused the request."""
        if unit not in self._units and len(self._units) >= UNITS_MAX:
            unit = OTHERS
        one = self._units.setdefault(unit, _Calls())
        one.calls += 1
        one.failed += failed
        one.spent_s += took_s
        one.longest_s = max(one.longest_s, took_s)

    def status(self) -> dict[str, dict[str, Any]]:
        """Return each unit's counts; `longest_call_s` is the longest call since the last status."""
        return {unit: _shown(one) for unit, one in self._units.copy().items()}


def _shown(one: _Calls) -> dict[str, Any]:
    longest_s, one.longest_s = one.longest_s, 0.0
    return {
        "calls": one.calls,
        "failed_calls": one.failed,
        "call_seconds": round(one.spent_s, 3),
        "longest_call_s": round(longest_s, 4),
    }
