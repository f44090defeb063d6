"""The core of the door supervisor for one door, without a network, in virtual time.

The tests give events to the core, and read its messages from a list.
"""

from bridges.kinds.door_supervisor import core
from bridges.kinds.door_supervisor.memory import DoorSupervisorLimits, SupervisedDoor
from bridges.kinds.door_supervisor.report import DoorHoldReport
from bridges.kinds.door_supervisor.signals import (
    DoorStateHeard,
    Event,
    RequesterCloses,
    RequesterOpens,
)
from bridges.messages.definitions import DoorModeValue, DoorRequest, Message
from tests.kinds.shared import alone

SECOND_NS = 10**9


class Alone(alone.Alone[SupervisedDoor, Event, DoorSupervisorLimits, DoorHoldReport]):
    """The core for one door. `faults` gets an entry (s, texts) at each change."""

    def __init__(self, limits: DoorSupervisorLimits | None = None, *, speaks: bool = True) -> None:
        self.faults: list[tuple[float, tuple[str, ...]]] = []
        super().__init__(
            core.initial("ward", 0.0), core.decide, limits or DoorSupervisorLimits(), speaks
        )

    def words(self, message: Message) -> str:
        assert isinstance(message, DoorRequest)
        assert (message.requester_id, message.door_name) == ("door_supervisor", "ward")
        return DoorModeValue(message.requested_mode.value).name.removeprefix("MODE_")

    def hears(self, event: Event) -> None:
        super().hears(event)
        faults = tuple(str(fault) for fault in self.report.faults)
        if faults != (self.faults[-1][1] if self.faults else ()):
            self.faults.append((round(self.now, 3), faults))

    def opens(self, who: str = "a", *, aged: float = 0.0) -> None:
        """Let an OPEN request arrive that was sent `aged` seconds ago."""
        self.hears(RequesterOpens(who, self.stamp(aged)))

    def closes(self, who: str = "a", *, aged: float = 0.0) -> None:
        """Let a CLOSE request arrive that was sent `aged` seconds ago."""
        self.hears(RequesterCloses(who, self.stamp(aged)))

    def stamp(self, aged: float) -> int:
        return round(self.stamped(aged) * SECOND_NS)

    def shows(self, mode: str, until: float | None = None) -> None:
        """Let a DoorState with this mode arrive. With `until` it arrives again each second until that
        time."""
        self.hears(DoorStateHeard(DoorModeValue[f"MODE_{mode}"]))
        while until is not None and self.now + 1.0 <= until:
            self.until(self.now + 1.0)
            self.hears(DoorStateHeard(DoorModeValue[f"MODE_{mode}"]))
        if until is not None:
            self.until(until)

    @property
    def holders(self) -> list[str]:
        return [holder.requester for holder in self.memory.holders]
