"""GPIO: the pins of a Raspberry Pi's 40-pin header, through gpiozero on lgpio.

Outputs are claimed at their safe level in one call and are left at it (`drivers/hal/gpio/pins.py`).
Inputs are sampled: an edge only calls `wake`, because lgpio loses edges. Points are `BCM17` or
`J8:11`; a bare number is refused, as it is the commonest wiring mistake.
"""

import logging
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any

import msgspec

from bridges.core.fields import Period
from bridges.log import pairs
from drivers.hal import Bus, BusType, HalError
from drivers.hal.gpio.dead_man import AFTER_S, DeadMan
from drivers.hal.points import Pull, Wire

log = logging.getLogger(__name__)

# The 40-pin header, the same on every Raspberry Pi since the B+ (2014): position -> BCM number.
# fmt: off
J8 = {
    3: 2, 5: 3, 7: 4, 8: 14, 10: 15, 11: 17, 12: 18, 13: 27, 15: 22, 16: 23, 18: 24, 19: 10,
    21: 9, 22: 25, 23: 11, 24: 8, 26: 7, 27: 0, 28: 1, 29: 5, 31: 6, 32: 12, 33: 13, 35: 19,
    36: 16, 37: 26, 38: 20, 40: 21,
}
# fmt: on
POSITION = {bcm: position for position, bcm in J8.items()}
SUPPLY = {1: "3.3 V", 2: "5 V", 4: "5 V", 17: "3.3 V"}

DROPPED = (
    f"no scan finished for {AFTER_S:g} s: the dead-man dropped every output. Find out why (the log,"
    " the load of this machine), then `rmf-bridge reset`"
)
FIXED_PULL_UP = ("BCM2", "BCM3")
HAT_EEPROM = ("BCM0", "BCM1")


class Settings(
    msgspec.Struct,
    frozen=True,
    kw_only=True,
    forbid_unknown_fields=True,
    tag_field="type",
    tag="gpio",
):
    """The header's pins.

    `chip`: the number of `/dev/gpiochipN`; found by its label `pinctrl-…` when absent.
    `scan_s`: how often every input is read.
    """

    chip: Annotated[int, msgspec.Meta(ge=0, le=255)] | None = None
    scan_s: Period = 0.05


def canonical(point: str) -> str:
    """`J8:7` and `BCM4` are `BCM4`. Raises ValueError with what to write instead."""
    if found := re.fullmatch(r"BCM(0|[1-9][0-9]?)", point):
        if int(found[1]) in POSITION:
            return point
        raise ValueError(f"{point} is not on the 40-pin header, which has BCM0 to BCM27")
    if found := re.fullmatch(r"J8:([1-9][0-9]?)", point):
        return _at(int(found[1]))
    if found := re.fullmatch(r"(?:gpio|bcm)[ _:]?0*([0-9]{1,2})", point, re.IGNORECASE):
        raise ValueError(f"{point!r} is not a pin's name: write BCM{found[1]}")
    if point.isdecimal():
        raise ValueError(
            f"{point!r} may be a position or a BCM number: write BCM{point} or J8:{point}"
        )
    raise ValueError(f"{point!r} is not a pin: write BCM17, or J8:11 for a position on the header")


def _at(position: int) -> str:
    if position in J8:
        return f"BCM{J8[position]}"
    if position > 40:
        raise ValueError(f"J8:{position} does not exist: the header has positions 1 to 40")
    raise ValueError(f"J8:{position} is {SUPPLY.get(position, 'ground')}, not a GPIO pin")


def describe(point: str) -> str:
    """`BCM4 = J8:7`, for the table that an electrician reads."""
    name = canonical(point)
    return f"{name} = J8:{POSITION[int(name[3:])]}"


def boot_level(point: str) -> bool:
    """The level to which a pin is pulled from power-on until it is claimed.

    BCM0-8 up, BCM9-27 down (BCM2835 ARM Peripherals, table 6-31, and its successors).
    """
    return int(canonical(point)[3:]) <= 8


def wire_problems(wire: Wire) -> Iterable[str]:
    """What cannot be right about this wire on a header pin."""
    try:
        name = canonical(wire.point)
    except ValueError:
        return  # reported where points are spelled
    if wire.direction == "in":
        if wire.pull is None:
            yield "pull is missing: say up, down, or none where an external resistor is fitted"
        elif name in FIXED_PULL_UP and wire.pull != "up":
            yield f"{name} has a fixed 1.8 kΩ pull-up: write pull: up, or use another pin"
    elif wire.pull is not None:
        yield "an output has no pull"
    elif wire.flash is not None:
        yield "flash is for modules that time pulses; a pin's are timed here: leave it out"
    elif name in HAT_EEPROM:
        yield f"{name} belongs to the HAT EEPROM, and the firmware drives it at boot: use another"


def open_bus(
    settings: Settings, factory: Any = None, clock: Callable[[], float] = time.monotonic
) -> "GpioBus":
    """The header's pins. Raises HalError with what to look at.

    `factory`: a gpiozero pin factory whose pins claim as those of `pins.py` do.
    """
    if factory is None:
        factory = _lgpio_factory(settings.chip)
    return GpioBus(factory, clock)


def _lgpio_factory(chip: int | None) -> Any:
    try:
        from drivers.hal.gpio import pins
    except ImportError as error:
        raise HalError(
            f"GPIO needs lgpio ({error}): apt install python3-lgpio, or pip install"
            " 'rmf-bridges[gpio]'; or run with --simulate"
        ) from error
    except OSError as error:  # lgpio makes a FIFO in the working directory when it is imported
        raise HalError(f"lgpio cannot write in the working directory: {error}") from error
    return pins.open_factory(chip)


class GpioBus(Bus):
    """The pins of one header, for the devices of one thread."""

    canonical = staticmethod(canonical)

    def __init__(self, factory: Any, clock: Callable[[], float]) -> None:
        self.factory = factory
        self._wake: Callable[[], None] | None = None
        self._devices: list[GpioLines] = []
        self._dead_man = DeadMan(self._drop, clock)

    def lines(self, inputs: Mapping[str, Pull | None], outputs: Mapping[str, bool]) -> "GpioLines":
        """Canonical inputs with their pull, outputs with their safe level (True is high)."""
        self._devices.append(GpioLines(self, dict(inputs), dict(outputs)))
        return self._devices[-1]

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Call `wake` from gpiozero's thread when an input may have changed. It must not raise."""
        self._wake = wake

    def edge(self, ticks: Any, state: Any) -> None:
        """An input has changed: gpiozero's signature."""
        if self._wake is not None:
            self._wake()

    def scanned(self) -> None:
        """Feed the dead-man."""
        self._dead_man.fed()

    def _drop(self) -> None:
        for device in self._devices:
            device.drop()
        log.critical(pairs("dead_man", reason=DROPPED))

    def close(self) -> None:
        """Every output to its safe level, and let go of the chip."""
        self._wake = None
        self._dead_man.close()
        for device in self._devices:
            device.close()
        try:
            self.factory.close()
        except _failures():
            return  # the kernel releases what is left when the process ends


class GpioLines:
    """The pins of one device (`drivers.hal.points.Lines`), by their BCM names."""

    def __init__(
        self, bus: GpioBus, inputs: dict[str, Pull | None], outputs: dict[str, bool]
    ) -> None:
        self._bus = bus
        self._pulls = inputs
        self._safe = outputs
        self._claimed: dict[str, Any] = {}
        self._dropped = False

    def claim(self) -> None:
        """Outputs at their safe level first, each in one call; then inputs. All, or none."""
        self._release()
        self._dropped = False
        try:
            for point, level in self._safe.items():
                with _hal_errors(point):
                    self._pin(point).output_with_state(level)
            for point, pull in self._pulls.items():
                with _hal_errors(point):
                    self._claim_input(point, pull)
        except HalError:
            self._release()
            raise

    def read(self) -> dict[str, bool]:
        """Every input's level, read now. Raises HalError."""
        self._check()
        return self._levels(self._pulls)

    def write(self, levels: Mapping[str, bool]) -> None:
        """Drive these outputs. Raises HalError."""
        for point, level in levels.items():
            if level != self._safe[point]:
                self._check()
            with _hal_errors(point):
                self._of(point).state = level
        if self._dropped and levels.items() - self._safe.items():
            self.drop()  # it happened meanwhile: what was just driven is dropped too
            self._check()

    def drop(self) -> None:
        """Every output to its safe level until the next claim, from any thread. Does not raise."""
        self._dropped = True
        for point, level in self._safe.items():
            if point in self._claimed:
                try:
                    self._claimed[point].state = level
                except _failures():
                    continue  # the others must still drop

    def outputs(self) -> dict[str, bool]:
        """The outputs' levels as the chip says. Raises HalError."""
        return self._levels(self._safe)

    def close(self) -> None:
        """Outputs to their safe level, and let go."""
        self._release()

    def _check(self) -> None:
        if self._dropped:
            raise HalError(DROPPED)

    def _levels(self, points: Iterable[str]) -> dict[str, bool]:
        levels = {}
        for point in points:
            with _hal_errors(point):
                levels[point] = bool(self._of(point).state)
        return levels

    def _of(self, point: str) -> Any:
        if point not in self._claimed:
            raise HalError(f"{describe(point)} is not claimed")
        return self._claimed[point]

    def _pin(self, point: str) -> Any:
        """Reserved before it is touched: gpiozero refuses a pin that another device holds."""
        self._bus.factory.reserve_pins(self, point)
        self._claimed[point] = self._bus.factory.pin(point)
        return self._claimed[point]

    def _claim_input(self, point: str, pull: Pull | None) -> None:
        pin = self._pin(point)
        pin.input_with_pull("floating" if pull in (None, "none") else pull)
        pin.edges = "both"
        pin.when_changed = self._bus.edge

    def _conflicts_with(self, other: object) -> bool:
        """gpiozero asks the requester of a pin about its holder."""
        return other is not self

    def _release(self) -> None:
        for point, pin in self._claimed.items():
            try:
                pin.close()
            except _failures():
                continue  # the others must still be let go
            finally:
                self._bus.factory.release_pins(self, point)
        self._claimed.clear()

    def __repr__(self) -> str:
        return f"another device of this daemon ({', '.join([*self._safe, *self._pulls])})"


def _failures() -> tuple[type[Exception], ...]:
    """What gpiozero and lgpio raise; lgpio only where it is loaded."""
    from gpiozero import GPIOZeroError

    lgpio = sys.modules.get("lgpio")
    return (GPIOZeroError, OSError, *((lgpio.error,) if lgpio else ()))


@contextmanager
def _hal_errors(point: str) -> Iterator[None]:
    try:
        yield
    except _failures() as error:
        text = getattr(error, "value", error)  # lgpio's errors print in quotes
        raise HalError(f"{describe(point)}: {text}") from error


BUS = BusType(
    settings=Settings,
    open_bus=open_bus,
    fake="hal_fakes.gpio",
    canonical=canonical,
    describe=describe,
    wire_problems=wire_problems,
)
