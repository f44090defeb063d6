"""The pins of one header. The bus claims, samples, drives and releases them through gpiozero."""

import logging
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from types import MappingProxyType
from typing import Protocol

from bridges.system.log import pairs
from drivers.hal import Bus, HalError
from drivers.hal.every import Every
from drivers.hal.gpio.dead_man import AFTER_S, GpioDeadMan
from drivers.hal.gpio.header import canonical, describe
from drivers.hal.points import Clearing, Pull

log = logging.getLogger(__name__)

DROPPED = (
    f"no scan finished for {AFTER_S:g} s: the dead-man switched every output off. Find out why (the"
    " log, the load of this machine), then run `rmf-bridge reset`"
)


class Pin(Protocol):
    """A gpiozero pin that claims lines in the same way as the pins of `pins.py`."""

    state: int
    edges: str
    when_changed: Callable[[object, object], None] | None

    def output_with_state(self, state: bool) -> None:
        """Claim the pin as an output that has this level from the first moment."""

    def input_with_pull(self, pull: str) -> None:
        """Claim the pin as an input with this pull resistor: `up`, `down` or `floating`."""

    def close(self) -> None:
        """Release the pin."""


class Factory(Protocol):
    """gpiozero's pin factory."""

    def reserve_pins(self, requester: object, *pins: str) -> None:
        """Reserve these pins for one requester. Raises GPIOZeroError if another requester has them."""

    def release_pins(self, requester: object, *pins: str) -> None:
        """Release the reservation."""

    def pin(self, name: str) -> Pin:
        """Return the pin of this name."""

    def close(self) -> None:
        """Release every pin."""


class GpioBus(Bus):
    """The pins of one header, for the devices of one thread."""

    canonical = staticmethod(canonical)

    def __init__(self, factory: Factory, clock: Callable[[], float]) -> None:
        self.factory = factory
        self._wake: Callable[[], None] | None = None
        self._devices: list[GpioLines] = []
        self._dead_man = GpioDeadMan(self._drop, clock)

    def lines(
        self,
        inputs: Mapping[str, Pull | None],
        outputs: Mapping[str, bool],
        unread: Collection[str] = (),
        clearing: Mapping[str, Clearing] = MappingProxyType({}),
    ) -> "GpioLines":
        """Return the lines of these points. `inputs` gives the pull resistor of each canonical input,
        and `outputs` gives the safe level of each output. GPIO ignores the last two parameters,
        which are for Modbus modules."""
        self._devices.append(GpioLines(self, dict(inputs), dict(outputs)))
        return self._devices[-1]

    def on_edge(self, wake: Callable[[], None]) -> None:
        """Let gpiozero's thread call `wake` when an input may have changed. `wake` must not raise."""
        self._wake = wake

    def edge(self, ticks: object, state: object) -> None:
        """Report a changed input. gpiozero prescribes the signature."""
        if self._wake is not None:
            self._wake()

    def scanned(self) -> None:
        """Tell the dead-man that a scan has finished."""
        self._dead_man.fed()

    def _drop(self) -> None:
        for device in self._devices:
            device.drop()
        log.critical(pairs("dead_man", reason=DROPPED))

    def close(self) -> None:
        """Set every output to its safe level and close the chip."""
        self._wake = None
        self._dead_man.close()
        for device in self._devices:
            device.close()
        try:
            self.factory.close()
        except _failures():
            return  # the kernel releases the lines when the process ends


class GpioLines:
    """The pins of one device (`drivers.hal.points.Lines`), by their BCM names."""

    def __init__(
        self, bus: GpioBus, inputs: dict[str, Pull | None], outputs: dict[str, bool]
    ) -> None:
        self._bus = bus
        self._pulls = inputs
        self._safe = outputs
        self._claimed: dict[str, Pin] = {}
        self._dropped = False

    def claim(self) -> None:
        """Claim each output at its safe level with one call, then claim the inputs. After a failure,
        release all lines."""
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
        """Read every input's level now. Raises HalError."""
        self._check()
        return self._levels(self._pulls)

    def write(self, levels: Mapping[str, bool]) -> None:
        """Drive these outputs. If an output fails, still try every output that should go to its safe
        level. Raises HalError."""
        unsafe = bool(levels.items() - self._safe.items())
        try:
            self._drive(levels)
        finally:
            if self._dropped and unsafe:
                self.drop()  # the dead-man intervened during this write, so switch off again
        if unsafe:
            self._check()

    def _drive(self, levels: Mapping[str, bool]) -> None:
        every = Every()
        for point, level in levels.items():
            if level != self._safe[point]:
                every.check()
                self._check()
            with every.one(), _hal_errors(point):
                self._of(point).state = level
        every.check()

    def drop(self) -> None:
        """Set every output to its safe level, and refuse other levels until the next claim. Any thread
        may call `drop`. Does not raise."""
        self._dropped = True
        for point, pin in self._claimed.copy().items():  # another thread may release the pins
            if point in self._safe:
                with suppress(Exception):  # still switch the other outputs off
                    pin.state = self._safe[point]

    def outputs(self) -> dict[str, bool]:
        """Read the outputs' levels from the chip. Raises HalError."""
        return self._levels(self._safe)

    def close(self) -> None:
        """Set the outputs to their safe level and release every line."""
        self._release()

    def _check(self) -> None:
        if self._dropped:
            raise HalError(DROPPED)

    def _levels(self, points: Iterable[str]) -> dict[str, bool]:
        levels, claimed = {}, self._claimed
        for point in points:
            try:
                levels[point] = bool((claimed.get(point) or self._of(point)).state)
            except _failures() as error:
                raise _hal_error(point, error) from error
        return levels

    def _of(self, point: str) -> Pin:
        if point not in self._claimed:
            raise HalError(f"{describe(point)} is not claimed")
        return self._claimed[point]

    def _pin(self, point: str) -> Pin:
        """Reserve a pin, and return it. gpiozero refuses a pin that another device holds."""
        self._bus.factory.reserve_pins(self, point)
        self._claimed[point] = self._bus.factory.pin(point)
        return self._claimed[point]

    def _claim_input(self, point: str, pull: Pull | None) -> None:
        pin = self._pin(point)
        pin.input_with_pull("floating" if pull in (None, "none") else pull)
        pin.edges = "both"
        pin.when_changed = self._bus.edge

    def _conflicts_with(self, other: object) -> bool:
        """Return whether `other` is a different device. gpiozero calls this when this device wants a
        pin that `other` holds."""
        return other is not self

    def _release(self) -> None:
        for point, pin in self._claimed.items():
            try:
                pin.close()
            except _failures():
                continue  # the other pins must still be released
            finally:
                self._bus.factory.release_pins(self, point)
        self._claimed.clear()

    def __repr__(self) -> str:
        return f"another device of this daemon ({', '.join([*self._safe, *self._pulls])})"


def _failures() -> tuple[type[Exception], ...]:
    """Return the error types of gpiozero and lgpio. Leave out a library that is not loaded."""
    gpiozero, lgpio = sys.modules.get("gpiozero"), sys.modules.get("lgpio")
    vendors = ((gpiozero, "GPIOZeroError"), (lgpio, "error"))
    return (OSError, *(getattr(vendor, name) for vendor, name in vendors if vendor))


@contextmanager
def _hal_errors(point: str) -> Iterator[None]:
    try:
        yield
    except _failures() as error:
        raise _hal_error(point, error) from error


def _hal_error(point: str, error: Exception) -> HalError:
    text = getattr(error, "value", error)  # str of an lgpio error would add quotes
    return HalError(f"{describe(point)}: {text}")
