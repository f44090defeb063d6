"""A simulated pedestrian door with an operator. The door opens while it is held or pushed, and closes
by itself.

The contacts are `opened` and `closed` at its end positions, `obstruction` (light curtain) and `fire`
(the building's alarm). The relay is `hold_open`. The signals to press are `push` (a person's button or
hand), `obstruction` and `fire`.

The part `operator` can fail. In the modes `off` and `stuck` the door stands still. In the mode `slow`
it takes five times as long. In the mode `wrong` it does the opposite of each command. In the mode
`garbage` it stops halfway. At a Modbus module `unit` and `server` can fail as well
(`hal_fakes/modbus/`).
"""

from collections.abc import Iterable
from typing import Final

from bridges.kinds.door.settings import DoorSettings
from drivers.hal.points import Wire
from hal_fakes.fake import Fake
from hal_fakes.plants.machine import WiredPlant

OPEN_S: Final = 2.0
CLOSE_S: Final = 3.0
AUTO_CLOSE_S: Final = 1.0
SLOWNESS: Final = 5.0
BUTTONS: Final = ("fire", "obstruction", "push")


def build(
    name: str, settings: DoorSettings, wires: Iterable[Wire], parts: Iterable[str] = ()
) -> "DoorPlant":
    """Build a door with these contacts and this relay. `parts` are the parts of its controller that can
    fail."""
    every_s = settings.pulse.every_s if settings.pulse else 0.0
    return DoorPlant(name, wires, auto_close_s=max(AUTO_CLOSE_S, every_s), parts=parts)


class DoorPlant(WiredPlant):
    """The door. `position` is 0 when closed and 1 when open.

    `open_s` and `close_s` are the times (s) of a whole travel. `auto_close_s` is the time (s) that the
    operator waits before it closes a released door. `parts` are the parts of the controller that can
    fail.
    """

    def __init__(
        self,
        name: str,
        wires: Iterable[Wire] = (),
        *,
        open_s: float = OPEN_S,
        close_s: float = CLOSE_S,
        auto_close_s: float = AUTO_CLOSE_S,
        parts: Iterable[str] = (),
    ) -> None:
        super().__init__(name, wires, ("operator", *parts), BUTTONS)
        self.position = 0.0
        self._seconds = {1: open_s, -1: close_s}
        self._auto_close_s = auto_close_s
        self._held = False
        self._wanted = False
        self._close_at = 0.0
        self._course = (0, 0.0)
        self._moved_at = 0.0
        self._arrives_at = float("inf")

    def contact(self, signal: str) -> bool:
        """Is this contact asserted at the operator? The contact's wire may show another value. A limit
        contact opens as soon as the door leaves its end position."""
        direction, _ = self._course
        if signal == "opened":
            return self.position == 1.0 and direction == 0
        if signal == "closed":
            return self.position == 0.0 and direction == 0
        return self.pressed[signal]

    def actuate(self, signal: str, energised: bool) -> None:
        """React to a change of the relay `hold_open`."""
        self._held = energised

    def run(self) -> None:
        """Move the door to its position at the present time. Then decide the next movement."""
        self._move()
        in_the_way = self.pressed["obstruction"] and self.position > 0
        wanted = self._held or self.pressed["push"] or in_the_way
        if self._wanted and not wanted:
            self._close_at = self.now + self._auto_close_s
        self._wanted = wanted
        self._steer(1 if wanted or self.now < self._close_at else -1)

    def event_at(self) -> float:
        """Return the time when the door arrives at an end position, or when it starts to close."""
        waits = not self._wanted and self.now < self._close_at
        return min(self._arrives_at, self._close_at if waits else float("inf"))

    def _move(self) -> None:
        direction, seconds = self._course
        if self.now >= self._arrives_at:
            self.position = self._limit(direction)
        elif direction:
            moved = (self.now - self._moved_at) / seconds
            self.position = min(1.0, max(0.0, self.position + direction * moved))
        self._moved_at = self.now

    def _limit(self, direction: int) -> float:
        if self.failures.get("operator") == "garbage":
            return 0.5
        return 1.0 if direction > 0 else 0.0

    def _steer(self, direction: int) -> None:
        """Move in this direction, as far as the operator's failure allows."""
        failure = self.failures.get("operator")
        if failure == "wrong":
            direction = -direction
        left = (self._limit(direction) - self.position) * direction
        if failure in ("off", "stuck") or left <= 0:
            self._course, self._arrives_at = (0, 0.0), float("inf")
            return
        seconds = self._seconds[direction] * (SLOWNESS if failure == "slow" else 1.0)
        if (direction, seconds) != self._course or self._arrives_at <= self.now:
            self._arrives_at = self.now + left * seconds
        self._course = (direction, seconds)


FAKE = Fake(plant=build)
