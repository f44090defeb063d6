"""The part of a lift's YAML that does not depend on its wiring."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.kinds.lift.signals import Side, Stop
from bridges.kinds.shared.alarming import AlarmingSettings
from bridges.kinds.shared.fields import (
    Brief,
    Name,
    Patience,
    Period,
    Seconds,
    Timeout,
    tells,
)
from bridges.kinds.shared.kind import FLOOR, Place
from bridges.kinds.shared.remarks import Remarks

AlarmOn = Annotated[
    list[Literal["fire_alarm", "code_blue", "earthquake", "emergency"]], Meta(min_length=1)
]

Pulse = Annotated[float, Meta(ge=0.05, le=60, extra={"unit": "s"})]


class Floor(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A floor of a mapping `floors`. It is needed if the rear door serves the floor, or if the floor
    code has another name for its landing."""

    level: Annotated[
        Name | None, tells("the landing's name in the floor code; when absent, the floor's name.")
    ] = None
    side: Annotated[Side, tells("the side of the car's door that opens at this floor.")] = (
        Side.FRONT
    )


class LiftDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and counts of a lift."""

    stale_after_s: Annotated[
        Period,
        tells("""how long reading or writing may fail. After that the lift is OFFLINE and its outputs
        are off."""),
    ] = 1.0
    release_grace_s: Annotated[
        Seconds,
        tells("""how long AGV mode and the door's hold stay on after END. In this time only the same
        session gets the lift."""),
    ] = 3.0
    agv_timeout_s: Annotated[
        Timeout,
        tells("""how long AGV mode may take to come on. After that the outputs go off and a fault is
        shown. Retries follow after 10, 30 and 60 s; then the fault latches."""),
    ] = 600.0
    floor_timeout_s: Annotated[
        Timeout,
        tells("""how long the ride to a floor may take. After that the same happens as after
        `agv_timeout_s`: outputs off, a fault, and retries."""),
    ] = 120.0
    door_timeout_s: Annotated[
        Timeout,
        tells("""how long the door may take to open. After that the same happens as after
        `agv_timeout_s`: outputs off, a fault, and retries."""),
    ] = 10.0
    request_timeout_s: Annotated[
        Patience,
        tells("""how long RMF may be silent; RMF repeats its request each second. After that a fault is
        shown, and the outputs go off unless a robot may be inside."""),
    ] = 30.0
    hazard_clear_s: Annotated[
        Seconds, tells("how long a hazard input must be clear before RMF may use the lift again.")
    ] = 1.0
    door_travel_s: Annotated[
        Seconds, tells("how long a door with one contact takes to move to its other end position.")
    ] = 5.0
    floor_travel_min_s: Annotated[
        Brief, tells("the least time from floor to floor. A faster change is not believed.")
    ] = 0.5
    call_pulse_s: Annotated[
        Pulse | None,
        tells("the length of a call's pulse; when absent, a call is held until the car arrives."),
    ] = None
    dead_time_s: Annotated[
        Brief,
        tells("""the pause between two calls, between the commands of two doors, and between a call
        and a door command."""),
    ] = 0.3
    min_off_s: Annotated[
        Brief,
        tells("""the least time for which a relay stays off before it may switch on again, to spare
        the relay. Switching off is never delayed."""),
    ] = 0.5
    max_cycles_per_min: Annotated[
        int,
        Meta(ge=1, le=600),
        tells("how often a relay may switch on in a minute; after that the relay waits."),
    ] = 20

    def problems(self) -> Remarks:
        """Yield a problem for limits that are too short for any ride."""
        least_s = self.floor_travel_min_s
        if self.floor_timeout_s <= least_s:
            text = (
                f"must be longer than floor_travel_min_s ({least_s:g} s): no ride would be in time"
            )
            yield ("floor_timeout_s",), text


class LiftSettings(AlarmingSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one lift, except its wiring."""

    floors: Annotated[
        list[Name] | dict[Name, Floor],
        tells("""the floors' names on RMF's map, from the lowest up. Write a mapping if a floor's
        landing has another name, or if the rear door serves a floor."""),
    ]
    agv_mode: Annotated[
        Literal["requested", "by_call"],
        tells("""how AGV mode is switched on. `requested`: by a separate output that stays on.
        `by_call`: by a call to a floor. AGV mode then stays on while the call is served, and while
        the door is held."""),
    ] = "requested"
    limits: Annotated[LiftDurations, tells("the limits that differ from their defaults.")] = (
        LiftDurations()
    )
    fire_reset: Annotated[
        Literal["auto", "manual"],
        tells("""when RMF may use the lift again after a fire alarm. `auto`: when the alarm clears.
        `manual`: only after `rmf-bridge reset`, even if the daemon restarts."""),
    ] = "auto"
    alarm_on: Annotated[
        AlarmOn,
        tells("""the hazards that raise an alarm on the topic of `alarm`. All robots then leave the
        lifts and stop elsewhere, until `rmf-bridge reset`."""),
    ] = msgspec.field(default_factory=lambda: ["fire_alarm"])

    def stale_after(self) -> float:
        """Return `stale_after_s` of the limits."""
        return self.limits.stale_after_s

    def awaited(self) -> Iterator[tuple[str, str, str]]:
        """Yield the inputs for which the lift's limits wait."""
        yield "agv_mode", "agv_timeout_s", ""
        yield "door", "door_timeout_s", ""
        yield "rear_door", "door_timeout_s", ""
        yield "floor", "floor_timeout_s", ""

    def on_map(self) -> list[Place]:
        """List the floors, which RMF's map must have too."""
        if isinstance(self.floors, list):
            return [(("floors", str(i)), FLOOR, name) for i, name in enumerate(self.floors)]
        return [(("floors", name), FLOOR, name) for name in self.floors]

    def stops(self) -> Mapping[str, Stop]:
        """Map RMF's name of each floor to its landing and door. The lowest floor is first."""
        if isinstance(self.floors, list):
            return {name: Stop(name) for name in self.floors}
        return {name: Stop(f.level or name, f.side) for name, f in self.floors.items()}

    def levels(self) -> list[str]:
        """List the landings, from the lowest up."""
        return list(dict.fromkeys(stop.level for stop in self.stops().values()))
