"""The moving and the warm parts of a charger: the pad that rises to a robot, and the coil.

| failing `pad` | off         | stuck            | slow         | garbage        | wrong         |
|               | it is down  | stays as it is   | rises slowly | stops half way | rises too far |
"""

import math
from typing import Final

from hal_fakes.plants.plant import FailureMode

NEVER: Final = float("inf")
SLOWNESS: Final = 10.0

CLEARANCE_MM: Final = 60.0
"""The gap (mm) between a robot's receiver and the lowered pad."""
RISE_MM: Final = 40.0
RISE_S: Final = 0.4
HEIGHTS_MM: Final[dict[FailureMode | None, float]] = {"off": 0.0, "garbage": 20.0, "wrong": 52.0}
"""The height (mm) of the pad in each failure mode. The pad does not reach RISE_MM, or rises beyond
it."""
GAP_MM: Final = (10.0, 30.0)
"""The range of gaps (mm) at which pad and receiver can couple."""

AMBIENT_C: Final = 25.0
TRIP_C: Final = 95.0
WARMS_IN_S: Final = 20.0


class LiftingPad:
    """The pad. `rises_until` is the time (monotonic s) when the pad stops rising. It is inf while the
    pad does not rise."""

    def __init__(self) -> None:
        self.rises_until = NEVER
        self._height_mm = 0.0

    def gap_mm(self) -> float:
        """Return the gap between the pad and a robot's receiver."""
        return CLEARANCE_MM - self._height_mm

    def at_height(self) -> bool:
        """Is the pad at its charging height?"""
        return self._height_mm == RISE_MM

    def couples(self) -> bool:
        """Can a charge cross the gap?"""
        return GAP_MM[0] <= self.gap_mm() <= GAP_MM[1]

    def follow(self, now: float, robot: bool, mode: FailureMode | None, pace: float) -> bool:
        """Raise the pad to a robot, or sink it without a robot. Return True if the pad has just arrived
        at the top."""
        goal = HEIGHTS_MM.get(mode, RISE_MM) if robot else 0.0
        if mode == "stuck" or self._height_mm == goal:
            self.rises_until = NEVER
        elif not goal:
            self._height_mm, self.rises_until = goal, NEVER
        elif self.rises_until == NEVER:
            self.rises_until = now + RISE_S / pace * (SLOWNESS if mode == "slow" else 1.0)
        elif now >= self.rises_until:
            self._height_mm, self.rises_until = goal, NEVER
            return True
        return False


class Coil:
    """The coil. Its temperature approaches the balance of heating and cooling."""

    def __init__(self) -> None:
        self._at, self._celsius, self._goal = 0.0, AMBIENT_C, AMBIENT_C

    def tend(self, now: float, goal: float) -> None:
        """Approach this temperature (°C) from now on."""
        self._at, self._celsius, self._goal = now, self.celsius(now), goal

    def celsius(self, now: float) -> float:
        """Return the temperature at `now` (s)."""
        rest = math.exp(-(now - self._at) / WARMS_IN_S)
        return self._goal + (self._celsius - self._goal) * rest

    def trips_at(self) -> float:
        """Return the time (s) when the coil gets too hot, or cool enough again. Return inf if neither
        happens."""
        if (self._goal > TRIP_C) == (self._celsius >= TRIP_C):
            return NEVER
        rest = (self._goal - TRIP_C) / (self._goal - self._celsius)
        return self._at - WARMS_IN_S * math.log(rest) + 1e-6
