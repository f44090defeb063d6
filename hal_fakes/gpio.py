"""The far side of the GPIO header: gpiozero's mock pins, wired to plants.

The daemon's own code and gpiozero run as on hardware. Only the pins are simulated. They claim an output
at its safe level in one call, as `drivers/hal/gpio/pins.py` does on hardware. gpiozero's own MockPin
would record a glitch during the claim. The simulated pins refuse the same uses as hardware: a second
claim of a pin, another pull on a pin with a fixed resistor, driving an input, a pull on an output.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

from gpiozero import PinInvalidFunction
from gpiozero.pins.mock import MockFactory, MockPin

from drivers.hal.gpio import GpioBus
from drivers.hal.gpio import GpioSettings as GpioSettings
from drivers.hal.gpio import open_bus as open_real_bus
from hal_fakes.fake import Inside
from hal_fakes.realtime import RealTime
from hal_fakes.wiring import PlantWiring


class WiredPin(MockPin):  # type: ignore[misc]
    """One pin of the header, with its wire."""

    factory: "WiredFactory"

    def __init__(self, factory: "WiredFactory", info: object) -> None:
        super().__init__(factory, info)
        self.point = f"BCM{self._number}"
        self._safe: bool | None = None

    def output_with_state(self, state: bool) -> None:
        """Claim the pin as an output at this level, which is the safe level. `close` sets the pin to
        the safe level again."""
        self._function = "output"
        self._state = self._safe = bool(state)
        self.clear_states()
        self.factory.driven(self.point, self._state)

    def input_with_pull(self, pull: str) -> None:
        """Claim the pin as an input. The first reading already has the wire's level."""
        if self._safe is not None:
            raise PinInvalidFunction(f"{self.point} is an output")
        super().input_with_pull(pull)
        self.factory.show(self.factory.clock(), only=self)
        self.clear_states()

    def close(self) -> None:
        """Set an output to its safe level, then release the pin. On hardware the kernel would keep this
        level after the release."""
        if self._safe is not None:
            self._change_state(self._safe)
        self._safe = None
        self._when_changed = None
        self._function = "input"

    def follow_wire(self, level: bool) -> None:
        """Set the pin to the wire's level. If the level changes, report an edge to the pin's
        watcher."""
        if self._function == "input":
            (self.drive_high if level else self.drive_low)()

    def _change_state(self, value: bool) -> bool:
        changed = bool(super()._change_state(value))
        if changed and self._function == "output":
            self.factory.driven(self.point, value)
        return changed


class WiredFactory(MockFactory):  # type: ignore[misc]
    """The header with its wiring.

    `clock` gives the time (s) at which the daemon changes an output. A thread holds `lock` while it
    sets pins to their wires' levels. So an older level never replaces a newer level.
    """

    def __init__(
        self,
        wirings: Sequence[PlantWiring],
        clock: Callable[[], float] = time.monotonic,
        lock: AbstractContextManager[object] | None = None,
    ) -> None:
        super().__init__(revision="a02082", pin_class=WiredPin)
        self.clock = clock
        self._lock = lock or nullcontext()
        self._wirings = wirings

    def driven(self, point: str, level: bool) -> None:
        """Record that the daemon has set an output to this level."""
        for wiring in self._wirings:
            if point in wiring.outputs:
                wiring.drive(point, level, self.clock())

    def show(self, now: float, only: WiredPin | None = None) -> None:
        """Set every claimed input to the level of its wire at `now` (s). With `only`, set only this
        input."""
        pins = [only] if only else list(self.pins.values())
        claimed = {pin.point: pin for pin in pins}
        with self._lock:
            for wiring in self._wirings:
                for point, level in wiring.levels(now).items():
                    if point in claimed:
                        claimed[point].follow_wire(level)


def open_bus(settings: GpioSettings, wirings: Sequence[PlantWiring], world: RealTime) -> GpioBus:
    """Open a real GPIO bus on pins wired to the plants of this bus."""
    factory = WiredFactory(wirings, lock=world.lock)
    world.on_step.append(factory.show)
    return open_real_bus(settings, factory)


FAKE = Inside(open_bus)
