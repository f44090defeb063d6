"""A simulated dispenser or ingestor: a conveyor that moves one item in each cycle, behind a small PLC.

The contacts are `ready`, `busy`, `done` and `fault`. `done` is on until the relay `start` is off, and
for at least DONE_S. The relays are `start`, and `select_…` for each sort of item. If `start` must stay
on during a cycle, the conveyor stops when `start` goes off. The edge `moved` counts the items that
really left.

The order `press` sets these signals:

- `hatch`: somebody has the hatch open. The workcell is not ready, and a running cycle stands still.
- `restart`: the PLC restarts and forgets its cycle. If the relay `start` is on, the PLC begins a new
  cycle.
- `fault`: the PLC reports a fault.

The part `conveyor` can fail. In the modes `off` and `stuck` it jams in the middle. In the mode `slow`
it takes five times as long. In the mode `wrong` the PLC reports a fault in the middle. In the mode
`garbage` the cycle ends without `done`.
"""

from collections.abc import Iterable
from typing import Final

from bridges.kinds.dispenser.settings import WorkcellSettings
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants.machine import WiredPlant

CYCLE_S: Final = 2.0
DONE_S: Final = 1.0
BOOT_S: Final = 1.0
SLOWNESS: Final = 5.0
NEAR_S: Final = 1e-9
NEVER: Final = float("inf")


def build(
    name: str, settings: WorkcellSettings, wires: Iterable[Wire], parts: Iterable[str] = ()
) -> "WorkcellPlant":
    """Build a workcell with these contacts and relays. `parts` are the parts of its controller that can
    fail."""
    return WorkcellPlant(name, wires, steady=settings.pulse_s is None, parts=parts)


class WorkcellPlant(WiredPlant):
    """One workcell. `moved` is the number of items that left. `steady` means that the start must stay
    on during the cycle."""

    def __init__(
        self, name: str, wires: Iterable[Wire], *, steady: bool, parts: Iterable[str] = ()
    ) -> None:
        super().__init__(name, wires, ("conveyor", *parts), ("hatch", "restart", "fault"))
        self.moved = 0
        self._steady = steady
        self._on = False
        self._busy = False
        self._left_s = 0.0
        self._ran_at = 0.0
        self._done_until = -NEVER
        self._boots_at = -NEVER
        self._fault = False

    def contact(self, signal: str) -> bool:
        """Is this contact asserted at the PLC? The contact's wire may show another value."""
        up = self.now >= self._boots_at and not self.pressed["restart"]
        done = self._on_since_done() or self.now < self._done_until
        return up and {
            "busy": self._busy,
            "done": done,
            "fault": self._fault or self.pressed["fault"],
            "ready": not (self._busy or done or self._fault or self.pressed["hatch"]),
        }.get(signal, False)

    def _on_since_done(self) -> bool:
        return self._on and self._done_until > -NEVER

    def actuate(self, signal: str, energised: bool) -> None:
        """React to a change of the relay `start`."""
        if signal != "start":
            return
        self._on = energised
        if energised:
            self._begin()
        elif self._steady:
            self._busy = False

    def act(self, signal: str, asserted: bool) -> None:
        """Restart the PLC at each change of its button `restart`."""
        if signal == "restart":
            self._busy, self._fault, self._done_until = False, False, -NEVER
            self._boots_at = self.now + BOOT_S

    def _begin(self) -> None:
        if not self._busy and self.now >= self._boots_at:
            self._busy, self._done_until, self._fault = True, -NEVER, False
            self._left_s, self._ran_at = CYCLE_S, self.now

    def run(self) -> None:
        """Move the item. After a restart of the PLC, begin a new cycle if the start is on."""
        self._move()
        if self.now == self._boots_at and self._on:
            self._begin()
        if self._busy and self._left_s <= NEAR_S:
            self._busy = False
            if self.failures.get("conveyor") != "garbage":
                self.moved += 1
                self._done_until = self.now + DONE_S
                self.note("sensor", "moved", self.moved)

    def _speed(self) -> float:
        if not self._busy or self.pressed["hatch"] or self.pressed["restart"]:
            return 0.0
        failure = self.failures.get("conveyor", "")
        jams = failure in ("off", "stuck", "wrong") and self._left_s <= CYCLE_S / 2 + NEAR_S
        return 0.0 if jams else 1 / SLOWNESS if failure == "slow" else 1.0

    def _move(self) -> None:
        elapsed_s, self._ran_at = self.now - self._ran_at, self.now
        self._left_s = max(0.0, self._left_s - elapsed_s * self._speed())
        if self._busy and self.failures.get("conveyor") == "wrong" and not self._speed():
            self._busy, self._fault = False, True
        if "conveyor" not in self.failures:
            self._fault = self._fault and self._on

    def event_at(self) -> float:
        """Return the time of the next event: half of the way, the end of the way, the end of `done`, or
        the end of a restart."""
        found = [at for at in (self._done_until, self._boots_at) if at > self.now]
        if speed := self._speed():
            half = self._left_s - CYCLE_S / 2
            found.append(self._ran_at + (half if half > NEAR_S else self._left_s) / speed)
        return min(found, default=NEVER)


FAKE = Fake(plant=build)
