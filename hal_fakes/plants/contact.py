"""One wire between a plant and a bus, and the ways in which wires fail.

Every bus has the same five failures, so a test scenario on GPIO also works on Modbus:

- `off`: the wire is cut. An input falls to its pull (it reads 0 at a module, and floats without a
  pull). The relay behind a cut output never energises.
- `stuck`: the wire holds its last value, as with a welded relay or a jammed contact.
- `slow`: every change arrives SLOW_S late.
- `garbage`: the value is random, and changes at most every GARBAGE_S. Each run has the same values.
- `wrong`: the value is inverted, as when somebody takes normally open for normally closed.
"""

import random
from collections import deque

from drivers.hal.points import Wire
from hal_fakes.plants.plant import FailureMode

SLOW_S = 2.0
GARBAGE_S = 0.1


class Contact:
    """One wire. `feed` takes the true value at one end, and `shows` is the value seen at the other end.

    For an input the plant feeds the wire, and the bus sees the value. For an output the daemon feeds
    the wire, and the relay sees the value. Values mean asserted or not. They are never levels.
    """

    def __init__(self, wire: Wire, seed: str) -> None:
        self.wire = wire
        self.shows = False
        self.mode: FailureMode | None = None
        self._fed = False
        self._late: deque[tuple[float, bool]] = deque()
        self._noise = random.Random(seed)
        self._noise_at = 0.0

    def feed(self, asserted: bool, now: float) -> None:
        """Take the true value at `now` (s)."""
        if asserted != self._fed and self.mode == "slow":
            self._late.append((now + SLOW_S, asserted))
        self._fed = asserted
        self._settle(now)

    def fail(self, mode: FailureMode | None, now: float) -> None:
        """Fail in this way from `now` on. None mends the wire."""
        self.mode = mode
        self._late.clear()
        self._noise_at = now
        self._settle(now)

    def next_at(self) -> float:
        """Return the next time (s) at which `shows` may change by itself. Return inf for a sound
        wire."""
        if self._late:
            return self._late[0][0]
        return self._noise_at if self._noisy() else float("inf")

    def _noisy(self) -> bool:
        floats = self.mode == "off" and self.wire.broken_reads() is None
        return floats or self.mode == "garbage"

    def _settle(self, now: float) -> None:
        while self._late and self._late[0][0] <= now:
            self.shows = self._late.popleft()[1]
        if self.mode is None or self.mode == "wrong":
            self.shows = self._fed != (self.mode == "wrong")
        elif self._noisy():
            self._draw(now)
        elif self.mode == "off":
            self.shows = bool(self.wire.broken_reads())

    def _draw(self, now: float) -> None:
        while self._noise_at <= now:
            self.shows = self._noise.random() < 0.5
            self._noise_at += GARBAGE_S
