"""The values that the panel core keeps from one scan to the next, and the settings that it needs (its
limits)."""

from collections.abc import Mapping

import msgspec

from bridges.kinds.alarm.settings import PanelDurations, PanelSettings
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.durations import AGES_AGO


class PanelLimits(msgspec.Struct, frozen=True):
    """The settings of a panel that its core needs. `t`: the durations. `debounce` maps a signal to its
    debounce (s)."""

    silent_alarm_after_s: float
    drill_s: float = 0.0
    t: PanelDurations = PanelDurations()
    debounce: Mapping[str, float] = {}

    @classmethod
    def of(cls, settings: PanelSettings, debounce: Mapping[str, float]) -> "PanelLimits":
        """Make the limits from the YAML and from `debounce`, which maps each wired signal to its
        debounce (s)."""
        drill_s = settings.drill_s or 0.0
        return cls(settings.silent_alarm_after_s, drill_s, settings.limits, debounce)


class PanelMemory(msgspec.Struct, frozen=True):
    """The memory of one panel. `began_at`: the time of the last good reading, or of the start.
    `read_at`: the time of the last good reading; None before the first.

    `sources`: each source, debounced. `drill`: the drill contact, debounced. `drill_until`: the end of
    the present drill. `io_fault`: the error of the last reading; "" if it succeeded.
    """

    began_at: float
    read_at: float | None = None
    sources: Mapping[str, Settled[bool]] = {}
    drill: Settled[bool | None] | None = None
    drill_until: float = AGES_AGO
    io_fault: str = ""
