"""A panel's report, for the log, the status file and the daemon's alarm."""

import msgspec

from bridges.kinds.shared.decision import AlarmInputs, Fault


class PanelReport(msgspec.Struct, frozen=True):
    """The present state of a panel. `active`: its active sources. `silent`: the panel gives no
    readings.

    `alarm`: the causes of an alarm for the fleets. `read_at`: the time of the last good reading
    (monotonic seconds), None before the first reading.
    """

    read_at: float | None
    active: tuple[str, ...] = ()
    silent: bool = False
    faults: tuple[Fault, ...] = ()
    alarm: AlarmInputs = AlarmInputs()

    def news(self) -> object:
        """Return everything except the time of the reading and the faults' details."""
        return self.active, self.silent, self.alarm, tuple(fault.code for fault in self.faults)
