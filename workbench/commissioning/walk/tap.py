"""A bus with a tap. The driver works as usual, and the tap shows a person the levels that the driver
reads."""

from collections.abc import Mapping
from typing import Any

from drivers.hal.points import Lines, Pull


class TappedLines:
    """Lines that remember the latest levels read."""

    def __init__(self, lines: Lines, levels: dict[str, int]) -> None:
        self.claim = lines.claim
        self.write = lines.write
        self.outputs = lines.outputs
        self.close = lines.close
        if hasattr(lines, "flash"):
            self.flash = lines.flash
        self._lines = lines
        self._levels = levels

    def read(self) -> Mapping[str, int]:
        """Read every input's level. Raises HalError."""
        found = self._lines.read()
        self._levels.update(found)
        return found


class Tap:
    """A wrapper of an open bus. `levels` maps each input to its last level. The key is the input's
    point in its standard spelling."""

    def __init__(self, bus: Any) -> None:
        self.levels: dict[str, int] = {}
        self._bus = bus

        self.scanned = bus.scanned
        self.insist = bus.insist
        self.close = bus.close

    def __getattr__(self, name: str) -> Any:
        """Pass all other attributes on to the bus."""
        return getattr(self._bus, name)

    def lines(
        self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool], *of_modbus: Any
    ) -> TappedLines:
        """Return one device's lines. The tap remembers their readings."""
        return TappedLines(self._bus.lines(inputs, outputs, *of_modbus), self.levels)
