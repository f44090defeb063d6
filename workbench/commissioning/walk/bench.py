"""Scan one device for a walk (`rmf-bridge walk`). The scan has a separate thread, so that a slow or
dead terminal never delays switching off."""

import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from bridges.system.log import plain
from drivers import Driver, DriverError
from drivers.hal.points import Wire
from workbench.commissioning.manual_control import not_off
from workbench.commissioning.walk import core
from workbench.commissioning.walk.core import (
    Event,
    InputsLost,
    InputsRead,
    Tick,
    WalkMemory,
    WalkStep,
)
from workbench.commissioning.walk.tap import Tap

SCAN_S: Final = 0.05


@dataclass(slots=True)
class ContactReading:
    """One contact's latest reading.

    - `levels`: the levels last read on the contact's bus, by point.
    - `seen`: the meanings (on, off) that readings have shown up to now.
    """

    wire: Wire
    point: str
    levels: Mapping[str, int] = field(default_factory=dict)
    level: int | None = None
    changed_at: float | None = None
    seen: frozenset[bool] = frozenset()

    @property
    def asserted(self) -> bool | None:
        """Return whether the signal is on. Return None before the first reading."""
        return None if self.level is None else self.wire.asserted(self.level)


class Bench:
    """A device under test. Its bus is wrapped in a `Tap`, which shows the levels read. `off` is the
    value that switches all outputs off.

    The bench is a context manager. At the end of the block, the bench switches every output off.
    `verified_off` tells whether a reading confirmed that every output is off.
    """

    def __init__(
        self,
        driver: Driver[Any, Any],
        bus: Tap,
        inputs: Sequence[ContactReading],
        steps: Sequence[WalkStep],
        off: object,
    ) -> None:
        self.inputs = inputs
        self.steps = steps
        self.memory = WalkMemory()
        self.verified_off = False
        self._driver = driver
        self._bus = bus
        self._off = off
        self._opened = False
        self._events: deque[Event] = deque()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="walk")

    def __enter__(self) -> "Bench":
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._stop.set()
        self._thread.join()

    def put(self, event: Event) -> None:
        """Queue the person's action. Any thread may call this method."""
        self._events.append(event)

    @property
    def decoded(self) -> str:
        """Return the driver's decoded inputs, in words."""
        return "" if self.memory.sample is None else plain(self.memory.sample)

    def _run(self) -> None:
        try:
            while not self._stop.wait(SCAN_S):
                self._scan()
        finally:
            self.verified_off = self._make_safe()
            self._driver.close()

    def _scan(self) -> None:
        self._decide(self._read())
        while self._events:
            self._decide(self._events.popleft())
        self._decide(Tick())
        try:
            if self._opened and self.steps:
                outputs = core.output_of(self.memory, self.steps)
                self._driver.write(self._off if outputs is None else outputs)
        except DriverError as error:
            self._decide(InputsLost(str(error)))
        self._bus.scanned()

    def _decide(self, event: Event) -> None:
        self.memory = core.decide(self.memory, event, time.monotonic(), self.steps)

    def _read(self) -> Event:
        try:
            if not self._opened:
                self._driver.open()
                self._opened = True
            sample = self._driver.read()
        except DriverError as error:
            return InputsLost(str(error))
        now = time.monotonic()
        for one in self.inputs:
            level = one.levels.get(one.point)
            if level is not None and level != one.level:
                one.level, one.changed_at = level, now
                one.seen |= {one.wire.asserted(level)}
        return InputsRead(sample)

    def _make_safe(self) -> bool:
        """Switch all outputs off. Do nothing if the walk has no outputs to test, so that a charge
        continues."""
        if not self.steps:
            return True
        if why := not_off(self._driver, self._bus.insist):
            self._decide(InputsLost(why))
        return not why
