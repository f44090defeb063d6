"""Stand-ins for RMF's traffic lights. A light answers as `EasyTrafficLight` does. A blockade reserves
checkpoints for robots.

As in RMF a new path is taken later, on RMF's own thread. As in RMF a robot without a path is not on the
schedule. The blockade is simpler than RMF's. It gives a robot the next checkpoint if the way there
keeps RADIUS_M from all points that other robots hold. There is no planner. Instead a test calls
`negotiates` and `agrees`, which stand for a negotiation.

Source: open-rmf/rmf_ros2, EasyTrafficLight.cpp; open-rmf/rmf_traffic, blockade/Moderator.cpp.
"""

from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from itertools import pairwise
from typing import Any, Final

from msgspec import Struct

Point = tuple[float, float]
RADIUS_M: Final = 0.8
STEP_M: Final = 0.4


class MovingInstruction(Enum):
    """A stand-in for `easy_traffic_light.MovingInstruction`."""

    MovingError = 0
    ContinueAtNextCheckpoint = 1
    WaitAtNextCheckpoint = 2
    PauseImmediately = 3


class WaitingInstruction(Enum):
    """A stand-in for `easy_traffic_light.WaitingInstruction`."""

    WaitingError = 0
    Resume = 1
    Wait = 2


class Waypoint(Struct):
    """A stand-in for `Waypoint`."""

    map_name: str
    position: list[float]
    mandatory_delay: object
    yields: bool


class TrafficLight:
    """A stand-in for `EasyTrafficLight`. The robot holds the checkpoints from `begin` to `end`, and may
    drive to `end`. `planned` tells whether RMF has a plan. `stops` tells whether the plan first
    makes the robot stand."""

    def __init__(self, name: str, pause: Callable[[], None], lights: "Lights") -> None:
        self.name, self.pause, self._lights = name, pause, lights
        self.path: Sequence[Waypoint] = ()
        self.begin = self.end = 0
        self.planned = self.stops = False
        self.idle: tuple[str, list[float]] | None = None
        self._new: Sequence[Waypoint] | None = None

    def follow_new_path(self, waypoint: Sequence[Waypoint]) -> None:
        """Take a path at the next `step`. Raises RuntimeError for a path that RMF does not take."""
        if len(waypoint) < 2 or any(_apart(a, b) < 1e-3 for a, b in pairwise(waypoint)):
            raise RuntimeError("the path has less than two checkpoints, or two at one place")
        self._new = waypoint

    def moving_from(self, checkpoint: int, location: Sequence[float]) -> MovingInstruction:
        """Answer a moving robot."""
        if not self._reaches(checkpoint, self.end - 1):
            return MovingInstruction.MovingError
        if not self.planned or self.stops:
            return MovingInstruction.PauseImmediately
        if self._lights.ready(self, checkpoint + 1):
            return MovingInstruction.ContinueAtNextCheckpoint
        return MovingInstruction.WaitAtNextCheckpoint

    def waiting_at(self, checkpoint: int) -> WaitingInstruction:
        """Answer a robot that stands at a checkpoint."""
        return self._waits(checkpoint, self.end, checkpoint)

    def waiting_after(self, checkpoint: int, location: Sequence[float]) -> WaitingInstruction:
        """Answer a robot that stands beyond a checkpoint."""
        return self._waits(checkpoint, self.end - 1, None)

    def last_reached(self) -> int:
        """Return the last checkpoint that was reached."""
        return self.begin

    def update_idle_location(self, map_name: str, position: list[float]) -> None:
        """Take the robot off the schedule."""
        self.path, self.idle, self.planned = (), (map_name, position), False
        self.begin = self.end = 0

    def negotiates(self) -> None:
        """Begin a negotiation whose plan lets the robot stand where it is."""
        self.stops = True
        self.pause()

    def agrees(self) -> None:
        """End the negotiation: the robot may go on."""
        self.stops = False

    def step(self) -> None:
        """Do what RMF does on its own thread."""
        if self._new is not None:
            self.path, self._new = self._new, None
            self.begin = self.end = 0
            self.planned = self.stops = False
        elif self.path:
            self.planned = True

    def _reaches(self, checkpoint: int, last: int) -> bool:
        if not self.path or (self.planned and checkpoint > last):
            return False
        if self.planned:
            self.begin = max(self.begin, checkpoint)
        return True

    def _waits(self, checkpoint: int, last: int, past: int | None) -> WaitingInstruction:
        if not self._reaches(checkpoint, last):
            return WaitingInstruction.WaitingError
        free = self.planned and not self.stops
        if free and (past is None or self._lights.ready(self, past)):
            return WaitingInstruction.Resume
        return WaitingInstruction.Wait

    def held(self, to: int) -> Iterator[tuple[str, Point]]:
        """Yield points of the path from `begin` to this checkpoint."""
        for at, after in pairwise(self.path[self.begin : to + 1]):
            steps = max(1, round(_apart(at, after) / STEP_M))
            start, end = complex(*at.position[:2]), complex(*after.position[:2])
            for number in range(steps + 1):
                point = start + (end - start) * number / steps
                yield at.map_name, (point.real, point.imag)
        if self.begin == to:
            at = self.path[to]
            yield at.map_name, (at.position[0], at.position[1])


class Lights:
    """The traffic lights of one fleet, and the blockade between them."""

    def __init__(self) -> None:
        self.handles: dict[str, TrafficLight] = {}

    def ready(self, light: TrafficLight, checkpoint: int) -> bool:
        """May the robot pass this checkpoint? If the way to the following checkpoint is free, reserve
        this way. The answer is True only at a later call."""
        if checkpoint < light.end:
            return True
        after = min(checkpoint + 1, len(light.path) - 1)
        others = [one for one in self.handles.values() if one is not light and one.path]
        taken = [point for one in others for point in one.held(one.end)]
        mine = [*light.held(after)]
        if not any(_near(a, b) for a in mine for b in taken):
            light.end = after
        return False  # as in RMF, the robot learns of the reservation only at a later call


def _near(one: tuple[str, Point], other: tuple[str, Point]) -> bool:
    (level, (x, y)), (other_level, (u, v)) = one, other
    return level == other_level and abs(complex(x - u, y - v)) < RADIUS_M


def _apart(one: Any, other: Any) -> float:
    x, y = (one.position[i] - other.position[i] for i in (0, 1))
    return abs(complex(x, y)) if one.map_name == other.map_name else 1.0
