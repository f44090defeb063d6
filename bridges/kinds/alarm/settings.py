"""The part of an alarm panel's YAML that does not depend on its wiring."""

from typing import Annotated

import msgspec

from bridges.kinds.shared.alarming import AlarmingSettings, alarm_problems
from bridges.kinds.shared.fields import Patience, Period, Seconds, Timeout, tells
from bridges.kinds.shared.remarks import Remarks


class PanelDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations of a panel."""

    stale_after_s: Annotated[
        Period,
        tells("the time without a good reading after which the panel is silent, which is a fault."),
    ] = 1.0
    clear_s: Annotated[
        Seconds,
        tells("""how long a source must be without an alarm to count as over; after that a person
        may reset it."""),
    ] = 1.0


class PanelSettings(AlarmingSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one panel, except its wiring."""

    silent_alarm_after_s: Annotated[
        Patience,
        tells("""how long the panel may be silent; after that its silence is an alarm. With a short
        time a broken cable soon stops the robots. With a long time a broken cable may hide a
        fire."""),
    ]
    drill_s: Annotated[
        Timeout | None,
        tells("""how long a drill lasts after the drill contact has come on; then the drill ends by
        itself."""),
    ] = None
    limits: Annotated[PanelDurations, tells("the durations that differ from their defaults.")] = (
        PanelDurations()
    )

    def stale_after(self) -> float:
        """Return `stale_after_s` of the limits."""
        return self.limits.stale_after_s

    def problems(self) -> Remarks:
        """Yield the fields that contradict each other."""
        yield from alarm_problems(self)
        if self.alarm == "none":
            text = "a panel must tell the fleets: write alarm: fire_alarm_trigger, which stops"
            yield ("alarm",), f"{text} every fleet, or alarm: emergency_signal, which names fleets"
        if self.silent_alarm_after_s < self.limits.stale_after_s:
            least = f"must be at least stale_after_s ({self.limits.stale_after_s:g} s)"
            yield ("silent_alarm_after_s",), least
