"""The part of a door's YAML that does not depend on its wiring."""

from collections.abc import Iterator
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.kinds.shared.alarming import AlarmingSettings, alarm_problems
from bridges.kinds.shared.fields import Patience, Seconds, Timeout, tells
from bridges.kinds.shared.remarks import Remarks

StaleAfter = Annotated[float, Meta(ge=0.1, le=60, extra={"unit": "s"})]
PulseSeconds = Annotated[float, Meta(ge=0.05, le=600, extra={"unit": "s"})]


class DoorDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations of a door."""

    stale_after_s: Annotated[
        StaleAfter,
        tells("how long reading may fail. After that the door is OFFLINE and the hold is off."),
    ] = 1.0
    close_grace_s: Annotated[
        Seconds,
        tells(
            "how long the hold stays on after a CLOSE. An OPEN within that time cancels the CLOSE."
        ),
    ] = 3.0
    travel_s: Annotated[
        Timeout,
        tells(
            "how long the door may be between its end positions; after that its state is UNKNOWN."
        ),
    ] = 10.0
    open_timeout_s: Annotated[
        Timeout, tells("how long a held door may take to open; after that a fault is shown.")
    ] = 15.0
    hazard_clear_s: Annotated[
        Seconds,
        tells("how long the input of a fire alarm or obstruction must be clear to count as over."),
    ] = 1.0
    open_delay_s: Annotated[
        Seconds | None, tells("how long the door takes to open. Only for `feedback: estimated`.")
    ] = None
    max_hold_s: Annotated[
        Patience | None,
        tells("how long RMF may hold the door. After that a fault is shown, but the hold stays."),
    ] = None
    supervisor_lost_s: Annotated[
        Patience | None,
        tells("""how long the door may be without a publisher of door requests; after that the hold
        ends. When absent, the door stays held, because a robot may stand in the doorway."""),
    ] = None


class Pulse(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Pulses on the relay while RMF holds the door. They are for a door operator that closes the door
    by itself after each pulse."""

    on_s: Annotated[PulseSeconds, tells("how long each pulse lasts.")]
    every_s: Annotated[PulseSeconds, tells("the time from one pulse's start to the next.")]


class DoorSettings(AlarmingSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one door, except its wiring."""

    limits: Annotated[DoorDurations, tells("the durations that differ from their defaults.")] = (
        DoorDurations()
    )
    feedback: Annotated[
        Literal["sensors", "estimated"],
        tells("""`estimated` if a limit contact is missing. The time since the hold was switched then
        replaces the contact. Logs and status mark an estimate, but RMF cannot see the difference."""),
    ] = "sensors"
    on_fire: Annotated[
        Literal["open", "release"] | None,
        tells("the effect of a fire alarm: `open` holds the door open, `release` ends the hold."),
    ] = None
    pulse: Annotated[
        Pulse | None,
        tells("pulses for a door operator that closes by itself. When absent, the relay stays on."),
    ] = None

    def stale_after(self) -> float:
        """Return `stale_after_s` of the limits."""
        return self.limits.stale_after_s

    def awaited(self) -> Iterator[tuple[str, str, str]]:
        """Yield the inputs for which the door's limits wait."""
        yield "opened", "open_timeout_s", ""
        yield "closed", "travel_s", ""

    def problems(self) -> Remarks:
        """Yield a problem for fields that contradict each other."""
        yield from alarm_problems(self)
        if self.alarm != "none" and self.on_fire is None:
            text = (
                "this door has no fire input, so it can raise no alarm: delete alarm, or wire fire"
            )
            yield ("alarm",), text
        if self.pulse and self.pulse.on_s >= self.pulse.every_s:
            yield (
                ("pulse", "on_s"),
                "must be shorter than every_s; delete pulse if the relay must stay on",
            )
        delay_s = self.limits.open_delay_s
        if self.feedback == "estimated" and delay_s is None:
            yield (
                ("limits",),
                "feedback: estimated needs open_delay_s, the time the door takes to open",
            )
        if self.feedback == "sensors" and delay_s is not None:
            yield (
                ("limits", "open_delay_s"),
                "has an effect only with feedback: estimated; otherwise contacts show an open door",
            )
        if delay_s is not None and delay_s > self.limits.travel_s:
            yield ("limits", "open_delay_s"), "must not be longer than travel_s"
        if delay_s is not None and delay_s >= self.limits.open_timeout_s:
            text = f"must be longer than open_delay_s ({delay_s:g} s): no opening would be in time"
            yield ("limits", "open_timeout_s"), text
