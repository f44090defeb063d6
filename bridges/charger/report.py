"""What RMF is told about a charger: ChargerState's content, and what the status file says beside it."""

from typing import Any

import msgspec
from msgspec.structs import replace

from bridges.charger.signals import Measured
from bridges.core.decision import Fault
from bridges.rmf.definitions import ChargerStateValue


class ChargerReport(msgspec.Struct, frozen=True):
    """ChargerState without its name and stamp.

    `read_at`: monotonic seconds of the last good reading, None before the first. `error_message`:
    blank unless `state` is CHARGER_ERROR. `request_id`: blank while no request holds the station.
    `fleet`, `robot`: whom it is for, else who is seen on the pad of a station that is not idle.
    `verified`: the station sees that robot's receiver; otherwise it is only the one that asked.
    """

    read_at: float | None
    state: ChargerStateValue
    error_message: str = ""
    request_id: str = ""
    fleet: str = ""
    robot: str = ""
    verified: bool = False
    faults: tuple[Fault, ...] = ()
    measured: Measured = Measured()

    def news(self) -> Any:
        """All but the age and the measurements, which differ at each reading."""
        measured = Measured(receiver_id=self.measured.receiver_id)
        return replace(self, read_at=None, measured=measured)
