"""gpiozero's pins on lgpio, with outputs that never glitch. Imported only where there is lgpio.

The stock `LGPIOPin` claims an output as an input, then as an output at low, and only then writes
its level: an active-low relay clicks at each start. On close it claims a floating input. These pins
claim once, at the safe level, and stay at it after close: the kernel of Raspberry Pi OS keeps the level
of a line that no process holds.

lgpio creates a FIFO in the working directory on import, so import it in the runtime directory.
"""

import os
from collections.abc import Callable, Iterable
from pathlib import Path

import lgpio
from gpiozero import PinFixedPull
from gpiozero.pins.lgpio import LGPIOFactory, LGPIOPin
from gpiozero.pins.local import LocalPiFactory, LocalPiPin

from drivers.hal import HalError
from drivers.hal.gpio.holders import holders

# Any board with the 40-pin header: gpiozero wants one to name pins, and a hardened unit hides
# /proc/cpuinfo, where it would look.
REVISION = 0xA02082
HEADER_LABEL = "pinctrl-"
PULLS = {"up": lgpio.SET_PULL_UP, "down": lgpio.SET_PULL_DOWN, "floating": lgpio.SET_PULL_NONE}


class HeldPin(LGPIOPin):  # type: ignore[misc]
    """One line, claimed in one call and left at its safe level."""

    def __init__(self, factory: LGPIOFactory, info: object) -> None:
        LocalPiPin.__init__(self, factory, info)  # LGPIOPin's own claims an input
        self._pwm = None
        self._bounce = None
        self._callback = None
        self._edges = lgpio.BOTH_EDGES
        self._held = False
        self._safe: int | None = None

    def output_with_state(self, state: bool) -> None:
        """Claim as an output at this level, which is its safe level and restored on close."""
        self._claim(lgpio.gpio_claim_output, int(state))
        self._safe = int(state)

    def input_with_pull(self, pull: str) -> None:
        """Claim as an input with this resistor."""
        if self.info.pull not in (pull, ""):
            raise PinFixedPull(f"{self!r} has a fixed pull-{self.info.pull} resistor")
        self._claim(lgpio.gpio_claim_input, PULLS[pull])
        self._safe = None

    def close(self) -> None:
        """Set an output to its safe level, then release the line. May be called twice."""
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

    def _claim(self, claim: Callable[[int, int, int], object], level_or_flags: int) -> None:
        try:
            claim(self.factory._handle, self._number, level_or_flags)
        except lgpio.error as error:
            raise HalError(f"BCM{self._number}: {error.value}{self._holder()}") from error
        self._held = True

    def _holder(self) -> str:
        """Who holds the line: the processes with the chip open, else the kernel's label."""
        *_, label = lgpio.gpio_get_line_info(self.factory._handle, self._number)
        if not label:
            return ""
        names = " or ".join(holders(Path(f"/dev/gpiochip{self.factory._chip}"))) or repr(label)
        return f"; it is held by {names}: stop that, or take another pin"


class HeldFactory(LGPIOFactory):  # type: ignore[misc]
    """Pins of an open chip. gpiozero's own constructor would choose the chip by the board."""

    def __init__(self, handle: int, chip: int) -> None:
        LocalPiFactory.__init__(self)
        self._handle = handle
        self._chip = chip
        self.pin_class = HeldPin

    def _get_revision(self) -> int:
        return REVISION


def open_factory(chip: int | None, dev: Path = Path("/dev")) -> HeldFactory:
    """The header's chip: this one, or the one found by its label. Raises HalError."""
    if chip is not None:
        return HeldFactory(_open(chip, dev), chip)
    numbers = sorted(int(p.name[8:]) for p in dev.glob("gpiochip*") if p.name[8:].isdecimal())
    refused = []
    for number in numbers:
        try:
            handle = _open(number, dev)
        except HalError as error:
            refused.append(str(error))
            continue
        if _label(handle).startswith(HEADER_LABEL):
            return HeldFactory(handle, number)
        lgpio.gpiochip_close(handle)
    raise HalError(_not_found(numbers, refused))


def _open(chip: int, dev: Path) -> int:
    path = dev / f"gpiochip{chip}"
    try:
        handle: int = lgpio.gpiochip_open(chip)
    except lgpio.error as error:
        if not path.exists():
            why = "there is no such chip"
        elif not os.access(path, os.R_OK | os.W_OK):
            why = "no permission: the daemon's user must be in the group gpio"
        else:
            why = str(error.value)
        raise HalError(f"{path}: {why}") from error
    return handle


def _label(handle: int) -> str:
    *_, label = lgpio.gpio_get_chip_info(handle)
    return str(label)


def _not_found(numbers: Iterable[int], refused: list[str]) -> str:
    if refused:
        return "; ".join(refused)
    seen = ", ".join(f"gpiochip{n}" for n in numbers) or "no GPIO chip at all"
    return f"no chip of a Raspberry Pi's header (label {HEADER_LABEL}…) among: {seen}"
