"""Doors on one bus in virtual time. Each scan round runs only when a test calls `round`."""

from collections.abc import Callable, Sequence

from bridges.kinds.door import KIND
from bridges.kinds.door.memory import DoorLimits
from bridges.kinds.door.settings import DoorSettings
from bridges.kinds.door.signals import DoorOutputs, DoorSample, OpenRequested
from bridges.messages.definitions import DoorState, Message
from bridges.messages.topics import Topic
from bridges.runtime.clock import Clock
from bridges.runtime.device import Node
from bridges.runtime.loop import Loop
from drivers import DriverError
from drivers.hal import Bus

SCAN_S = 0.25


class Door:
    """A stand-in for a door's driver. Each reading calls `during`. If `lost` is set, switching the door
    off fails."""

    def __init__(self, name: str, log: Callable[[str], None]) -> None:
        self.during: Callable[[], None] = lambda: None
        self.lost = False
        self.opened = False
        self._name = name
        self._log = log

    def open(self) -> None:
        self._log(f"{self._name} claimed")

    def read(self) -> DoorSample:
        self._log(f"{self._name} read")
        self.during()
        return DoorSample(opened=self.opened, closed=not self.opened)

    def write(self, outputs: DoorOutputs) -> None:
        if outputs.hold_open:
            self._log(f"{self._name} held")

    def make_safe(self) -> None:
        if self.lost:
            raise DriverError("no answer")
        self._log(f"{self._name} off")

    def close(self) -> None:
        self._log(f"{self._name} closed")


class Wires(Bus):
    """A bus that can report edges. The test calls `edge`. `fed`: how often a round has ended."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log = log
        self.fed = 0
        self.edge: Callable[[], None] = lambda: None

    def scanned(self) -> None:
        self.fed += 1

    def on_edge(self, wake: Callable[[], None]) -> None:
        self.edge = wake

    def insist(self) -> None:
        self._log("bus insists")

    def close(self) -> None:
        self._log("bus closed")


class Corridor:
    """A scan loop for the named doors on one bus, by default two doors. `story` lists all events, each
    as (time in s, text)."""

    def __init__(
        self, debounce: dict[str, float] | None = None, doors: Sequence[str] = ("ward", "lab")
    ) -> None:
        self.now = 0.0
        self.story: list[tuple[float, str]] = []
        self.bus = Wires(self.tell)
        self.doors = {name: Door(name, self.tell) for name in doors}
        clock = Clock(lambda: self.now, lambda: 1e6 + self.now)
        settings = DoorSettings()
        limits = DoorLimits.of(settings, debounce or {})
        self.states: list[tuple[float, DoorState]] = []
        nodes = [
            Node(name, KIND, settings, limits, door, self.publish, clock)
            for name, door in self.doors.items()
        ]
        self.loop = Loop("module", self.bus, nodes, SCAN_S, clock)

    def publish(self, topic: Topic[Message], message: Message) -> None:
        if isinstance(message, DoorState):
            self.states.append((round(self.now, 3), message))

    def tell(self, what: str) -> None:
        self.story.append((self.now, what))

    def round(self, at: float) -> list[str]:
        """Run one round at this time (s), and return the round's events."""
        self.now = at
        before = len(self.story)
        self.loop.round()
        return [what for _, what in self.story[before:]]

    def falls_silent(self, door: str, timeout_s: float) -> None:
        """Let each later reading of this door end with a timeout."""

        def waits() -> None:
            self.now += timeout_s
            self.bus.calls += 1
            raise DriverError("no answer")

        self.doors[door].during = waits

    def asks(self, door: str) -> None:
        """Let RMF ask this door to open."""
        self.loop.inbox.put(door, OpenRequested("a"))
