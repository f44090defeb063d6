"""The part of a lift's YAML that does not depend on how it is wired."""

from collections.abc import Mapping
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.core.fields import DeviceSettings, Name, Period, Seconds, Timeout
from bridges.core.kind import Place
from bridges.lift.signals import Side, Stop
from bridges.settings.building_map import FLOOR


class Floor(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A floor that differs from its landing's name, or is served by the car's rear door.

    `level`: the landing as the floor code table names it; the floor's own name when absent.
    `side`: which of the car's doors opens there.
    """

    level: Name | None = None
    side: Side = Side.FRONT


class Durations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and counts of a lift.

    `stale_after_s`: without a good reading, or without a good write, for this long the lift is
    OFFLINE and its outputs off.
    `release_grace_s`: how long AGV mode and the door are still held after END, for the same session.
    `agv_timeout_s`, `floor_timeout_s`, `door_timeout_s`: AGV mode not granted, floor not reached,
    door not open: outputs off and a fault; tried again after 10, 30 and 60 s, then latched.
    `request_timeout_s`: RMF repeats requests at 1 Hz; after this silence the outputs go off unless a
    robot may be inside, and a fault is shown.
    `hazard_clear_s`: how long a hazard input must be clear before the lift is RMF's again.
    `door_travel_s`: with one door contact, how long the door may take to its other end.
    `floor_travel_min_s`: the least time from one floor to the next; a faster jump is no position.
    `call_pulse_s`: a call is pulsed for so long; held until arrival when absent.
    `dead_time_s`: between two calls, two doors' commands, and a call and a door command.
    `min_off_s`, `max_cycles_per_min`: spare the relays; they delay switching on, never off.
    """

    stale_after_s: Period = 1.0
    release_grace_s: Seconds = 3.0
    agv_timeout_s: Timeout = 600.0
    floor_timeout_s: Timeout = 120.0
    door_timeout_s: Timeout = 10.0
    request_timeout_s: Timeout = 30.0
    hazard_clear_s: Seconds = 1.0
    door_travel_s: Seconds = 5.0
    floor_travel_min_s: Seconds = 0.5
    call_pulse_s: Seconds | None = None
    dead_time_s: Seconds = 0.3
    min_off_s: Seconds = 0.5
    max_cycles_per_min: Annotated[int, Meta(ge=1, le=600)] = 20


class LiftSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What RMF and the building agree on about one lift.

    `floors`: as RMF's map names them, from the lowest up; a mapping where a floor has another name
    than its landing, or `side: rear`.
    `agv_mode`: how it comes: `requested` by an output that is held, or `by_call`: a call brings it,
    and it stays while the call is served and the door is held.
    `limits`: durations and counts, where the defaults do not suit.
    `fire_reset`: whether the lift is RMF's again when the alarm clears (`auto`), or only after
    `rmf-bridge reset` (`manual`).
    `alarm`: tell the fleets of a fire on this topic; `none` unless the site has decided so.
    """

    floors: list[Name] | dict[Name, Floor]
    agv_mode: Literal["requested", "by_call"] = "requested"
    limits: Durations = Durations()
    fire_reset: Literal["auto", "manual"] = "auto"
    alarm: Literal["none", "fire_alarm_trigger", "emergency_signal"] = "none"

    def stale_after(self) -> float:
        """As its limits say."""
        return self.limits.stale_after_s

    def on_map(self) -> list[Place]:
        """RMF's map has these floors too."""
        if isinstance(self.floors, list):
            return [(("floors", str(i)), FLOOR, name) for i, name in enumerate(self.floors)]
        return [(("floors", name), FLOOR, name) for name in self.floors]

    def stops(self) -> Mapping[str, Stop]:
        """RMF's floor name -> landing and door, from the lowest up."""
        if isinstance(self.floors, list):
            return {name: Stop(name) for name in self.floors}
        return {name: Stop(f.level or name, f.side) for name, f in self.floors.items()}

    def levels(self) -> list[str]:
        """The landings, from the lowest up."""
        return list(dict.fromkeys(stop.level for stop in self.stops().values()))
