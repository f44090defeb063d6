"""A lift's fixed facts as its core needs them: floors, doors, durations."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from bridges.lift.settings import LiftSettings, Limits
from bridges.lift.signals import Side, Stop


class LiftLimits(msgspec.Struct, frozen=True):
    """`stops`: RMF's floor name -> landing and door, from the lowest up. `t`: the durations."""

    stops: Mapping[str, Stop]
    t: Limits = Limits()
    debounce: Mapping[str, float] = {}
    fire_reset: Literal["auto", "manual"] = "auto"
    alarm: Literal["none", "fire_alarm_trigger", "emergency_signal"] = "none"

    @classmethod
    def of(cls, settings: LiftSettings, debounce: Mapping[str, float]) -> "LiftLimits":
        """From the YAML and the wiring's debounce (s) by signal."""
        return cls(settings.stops(), settings.limits, debounce, settings.fire_reset, settings.alarm)

    def debounce_s(self, signal: str) -> float:
        """How long a change of this signal must last."""
        return self.debounce.get(signal, 0.0)

    def index(self, level: str) -> int:
        """The landing's place in the shaft, 0 for the lowest."""
        levels = list(dict.fromkeys(stop.level for stop in self.stops.values()))
        return levels.index(level)

    def floor_name(self, level: str, preferred: str) -> str:
        """RMF's name for a landing: `preferred` where that is one, else the first."""
        if preferred in self.stops and self.stops[preferred].level == level:
            return preferred
        return next(name for name, stop in self.stops.items() if stop.level == level)

    def side(self, floor: str) -> Side:
        """Which of the car's doors serves this floor."""
        return self.stops[floor].side
