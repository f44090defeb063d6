"""Pins on lgpio, without gpiozero. They are for a new process that only switches outputs off. Loading
gpiozero would delay such a process.

The calls that claim, write and release outputs are the same as in `pins.py`. These pins report no
edges.
"""

from collections.abc import Callable

import lgpio

from drivers.hal.gpio.chip import PULLS, claim, open_chip


class BarePin:
    """One line. One call claims the line, and `close` leaves the line at its safe level."""

    edges = "none"
    when_changed: Callable[[object, object], None] | None = None

    def __init__(self, handle: int, chip: int, line: int) -> None:
        self._handle, self._chip, self._line = handle, chip, line
        self._held = False
        self._safe: int | None = None

    @property
    def state(self) -> int:
        """Read the line's level now."""
        level: int = lgpio.gpio_read(self._handle, self._line)
        return level

    @state.setter
    def state(self, level: int) -> None:
        lgpio.gpio_write(self._handle, self._line, int(level))

    def output_with_state(self, state: bool) -> None:
        """Claim the line as an output at this level. This level is the line's safe level, which `close`
        restores."""
        self._claim(lgpio.gpio_claim_output, int(state))
        self._safe = int(state)

    def input_with_pull(self, pull: str) -> None:
        """Claim the line as an input with this pull resistor."""
        self._claim(lgpio.gpio_claim_input, PULLS[pull])

    def close(self) -> None:
        """Set an output to its safe level, then release the line. The caller may call `close` twice."""
        if not self._held:
            return
        self._held = False
        if self._safe is not None:
            lgpio.gpio_write(self._handle, self._line, self._safe)
        lgpio.gpio_free(self._handle, self._line)

    def _claim(self, call: Callable[[int, int, int], object], value: int) -> None:
        claim(call, self._handle, self._chip, self._line, value)
        self._held = True


class BareFactory:
    """The lines of an open chip. No reservation of pins is needed here, because the kernel refuses to
    claim one pin twice in one process."""

    def __init__(self, chip: int | None) -> None:
        """Open this chip. Without a number, open the header's chip. Raises HalError."""
        self._handle, self._chip = open_chip(chip)

    def reserve_pins(self, requester: object, *pins: str) -> None:
        """Do nothing, because the check of the YAML has found double use already."""

    def release_pins(self, requester: object, *pins: str) -> None:
        """Do nothing."""

    def pin(self, name: str) -> BarePin:
        """Return the pin of this canonical name (`BCM17`)."""
        return BarePin(self._handle, self._chip, int(name.removeprefix("BCM")))

    def close(self) -> None:
        """Close the chip."""
        lgpio.gpiochip_close(self._handle)
