"""The part of a door's YAML that does not depend on how it is wired."""

from collections.abc import Iterator
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from bridges.core.fields import DeviceSettings, Seconds, Timeout

StaleAfter = Annotated[float, Meta(ge=0.1, le=60, extra={"unit": "s"})]
PulseSeconds = Annotated[float, Meta(ge=0.05, le=600, extra={"unit": "s"})]


class Durations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations of a door.

    `stale_after_s`: without a good reading for this long the door is OFFLINE and its hold off.
    `close_grace_s`: how long a CLOSE waits before the hold is released; an OPEN meanwhile cancels it.
    `travel_s`: between its limits for longer, the door's position is UNKNOWN.
    `open_timeout_s`: held for so long and still not open is a fault.
    `hazard_clear_s`: how long a fire alarm or an obstruction must be away before it counts as over.
    `open_delay_s`: with estimated feedback, how long the door takes to open.
    `max_hold_s`: held by RMF for longer is a fault that is shown; the hold stays.
    """

    stale_after_s: StaleAfter = 1.0
    close_grace_s: Seconds = 3.0
    travel_s: Timeout = 10.0
    open_timeout_s: Timeout = 15.0
    hazard_clear_s: Seconds = 1.0
    open_delay_s: Seconds | None = None
    max_hold_s: Seconds | None = None


class Pulse(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """For an operator that closes by itself: the relay is triggered again while RMF holds the door.

    `on_s`: how long the relay is on.
    `every_s`: from one trigger to the next.
    """

    on_s: PulseSeconds
    every_s: PulseSeconds


class DoorSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What RMF and the building agree on about one door.

    `limits`: durations, where the defaults do not suit.
    `feedback`: `estimated` where a limit contact is missing and the door's times must do; such a
    state is marked in logs and status, and RMF cannot see the difference.
    `on_fire`: whether a fire alarm holds the door `open`, or takes the hold away (`release`).
    `pulse`: re-trigger an operator that closes by itself; absent, the relay stays on.
    """

    limits: Durations = Durations()
    feedback: Literal["sensors", "estimated"] = "sensors"
    on_fire: Literal["open", "release"] | None = None
    pulse: Pulse | None = None

    def stale_after(self) -> float:
        """As its limits say."""
        return self.limits.stale_after_s

    def problems(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """What the fields cannot say one by one."""
        if self.pulse and self.pulse.on_s >= self.pulse.every_s:
            yield (
                ("pulse", "on_s"),
                "must be shorter than every_s; leave pulse out for a steady hold",
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
                "is for feedback: estimated; contacts say when it is open",
            )
        if delay_s is not None and delay_s > self.limits.travel_s:
            yield ("limits", "open_delay_s"), "must not be longer than travel_s"
