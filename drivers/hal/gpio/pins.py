"""gpiozero's pins on lgpio, with outputs that never glitch. Import this file only where lgpio is
installed.

gpiozero's own `LGPIOPin` claims an output in three steps: as an input, then as a low output, and only
then with the wanted level. So an active-low relay clicks at each start. On close `LGPIOPin` claims a
floating input.

The pins of this file claim a line once, at its safe level. They keep this level after close, because
the kernel of Raspberry Pi OS keeps the level of a line that no process holds.
"""

from collections.abc import Callable
from pathlib import Path

import lgpio
from gpiozero import PinFixedPull
from gpiozero.pins.lgpio import LGPIOFactory, LGPIOPin
from gpiozero.pins.local import LocalPiFactory, LocalPiPin

from drivers.hal.gpio.chip import DEV, PULLS, claim, open_chip

# The revision of any board with the 40-pin header. gpiozero must know a board to know the names of the
# pins. gpiozero would read the revision from /proc/cpuinfo, but the daemon's hardened systemd unit
# hides that file.
REVISION = 0xA02082


class HeldPin(LGPIOPin):  # type: ignore[misc]
    """One line. One call claims the line, and `close` leaves the line at its safe level."""

    def __init__(self, factory: LGPIOFactory, info: object) -> None:
        LocalPiPin.__init__(self, factory, info)  # the constructor of LGPIOPin would claim an input
        self._pwm = None
        self._bounce = None
        self._callback = None
        self._edges = lgpio.BOTH_EDGES
        self._held = False
        self._safe: int | None = None

    def output_with_state(self, state: bool) -> None:
        """Claim the line as an output at this level. This level is the line's safe level, which `close`
        restores."""
        self._claim(lgpio.gpio_claim_output, int(state))
        self._safe = int(state)

    def input_with_pull(self, pull: str) -> None:
        """Claim the line as an input with this resistor."""
        if self.info.pull not in (pull, ""):
            raise PinFixedPull(f"{self!r} has a fixed pull-{self.info.pull} resistor")
        self._claim(lgpio.gpio_claim_input, PULLS[pull])
        self._safe = None

    def close(self) -> None:
        """Set an output to its safe level, then release the line. The caller may call `close` twice."""
        if not self._held or self.factory._handle is None:
            return
        self._held = False
        if self._callback is not None:
            self._callback.cancel()
            self._callback = None
        self._when_changed = None
        if self._safe is not None:
            lgpio.gpio_write(self.factory._handle, self._number, self._safe)
        lgpio.gpio_free(self.factory._handle, self._number)

    def _claim(self, call: Callable[[int, int, int], object], level_or_flags: int) -> None:
        factory = self.factory
        claim(call, factory._handle, factory._chip, self._number, level_or_flags)
        self._held = True


class HeldFactory(LGPIOFactory):  # type: ignore[misc]
    """The pins of a chip that is already open. gpiozero's own constructor would choose a chip by the
    board, so this constructor gets the open chip instead."""

    def __init__(self, handle: int, chip: int) -> None:
        LocalPiFactory.__init__(self)
        self._handle = handle
        self._chip = chip
        self.pin_class = HeldPin

    def _get_revision(self) -> int:
        return REVISION


def open_factory(chip: int | None, dev: Path = DEV) -> HeldFactory:
    """Open the header's chip by this number. Without a number, find the chip by its label. Raises
    HalError."""
    return HeldFactory(*open_chip(chip, dev))
