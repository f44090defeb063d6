"""Buses: the only importers of vendor libraries, each lazily and in its own file.

A file is named after the bus `type:` of the YAML and holds `Settings` (a msgspec struct) and
`open_bus(settings) -> Bus`. A Bus belongs to one thread. Every failure is a HalError, raised within
the bus's I/O timeout; after one, attempts follow with a backoff from 0.5 to 30 s during which calls
fail at once, so that a dead device costs the others on its bus no more than one timeout a period.
"""

from collections.abc import Callable

from drivers.hal.points import HalError

__all__ = ["Bus", "HalError"]


class Bus:
    """What every bus has; the rest depends on its type (`points.PointsBus`, HTTP calls…)."""

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Call `wake` (from any thread) when an input may have changed; nothing where polled."""

    def scanned(self) -> None:
        """A scan has finished: a dead-man, where there is one, drops the outputs when this stops."""

    def insist(self) -> None:
        """Try at once what is asked next, whatever the backoff: outputs are about to go off."""

    def close(self) -> None:
        """Release the bus. Does not raise; may be called twice."""


# A bus file whose bus has points also holds, at module level and without its vendor library:
#   canonical(point: str) -> str            one spelling; ValueError says what to write instead
#   wire_problems(wire: Wire) -> Iterable[str]   what cannot be right about this wire on this bus
#
# A bus file may also have `warnings(settings)`: (path, text) of what is legal but worth a look.
