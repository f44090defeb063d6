"""The values that the door supervisor keeps for one door, and the settings that it needs (its
limits)."""

from typing import Final

import msgspec
from msgspec.structs import replace

from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.kinds.shared.durations import AGES_AGO, NEVER, SILENT_S
from bridges.kinds.shared.freshness import Requesters
from bridges.kinds.shared.graph_kind import LISTENS
from bridges.messages.definitions import DoorModeValue

VISIT_S: Final = 2.5
"""The longest silence (s) of a robot that still waits at the door, because a waiting robot repeats OPEN
at 1 Hz. An OPEN after a longer silence begins a new visit."""

CLOSED: Final = DoorModeValue.MODE_CLOSED
MOVING: Final = DoorModeValue.MODE_MOVING
OPEN: Final = DoorModeValue.MODE_OPEN


class DoorSupervisorLimits(msgspec.Struct, frozen=True):
    """The duration (s) that the site has set for one door."""

    open_alarm_s: float = 600.0

    @classmethod
    def of(cls, settings: DoorSupervisorSettings) -> "DoorSupervisorLimits":
        """Make the limits from the YAML."""
        return cls(settings.open_alarm_s)


class Holder(msgspec.Struct, frozen=True):
    """A requester that has held the door open since `since` (our clock).

    `asked_at`: the time of the latest OPEN. `stamp`: the stamp of the latest OPEN. `visit`: the stamp
    of the first OPEN of the present visit; repeats do not change it. `restored`: the requester held the
    door before our restart.
    """

    requester: str
    since: float
    asked_at: float
    stamp: int
    visit: int
    restored: bool = False

    def repeats(self, stamp: int, now: float) -> "Holder":
        """Return the holder after one more OPEN."""
        again = now > self.asked_at + VISIT_S
        return replace(self, asked_at=now, stamp=stamp, visit=stamp if again else self.visit)


class SupervisedDoor(msgspec.Struct, frozen=True):
    """The memory of one door from event to event.

    `passive`: if we may not publish, the reason why requesters must wait. `at_once`: a door with a
    restored holder may be held even before we may publish. `holders`: the requesters that hold the
    door, in the order of arrival. `requesters`: the record of each requester's stamps. `mode`: the
    door's last mode, heard at `shown_at`. `sent`: the last request to the door's node; None after the
    permission to publish has come or gone. `prompted`: the request must be repeated.
    """

    door: str
    may_speak: bool = False
    passive: str = LISTENS
    at_once: bool = False
    holders: tuple[Holder, ...] = ()
    requesters: Requesters = {}
    mode: DoorModeValue | None = None
    shown_at: float = AGES_AGO
    sent: DoorModeValue | None = None
    sent_at: float = AGES_AGO
    prompted: bool = False

    @property
    def wanted(self) -> DoorModeValue:
        """The mode that we request of the door's node."""
        return OPEN if self.holders else CLOSED

    @property
    def may_send(self) -> bool:
        """Return whether we may send to the door's node now.

        During the quiet start we may send only if a holder from before the restart holds the door, and
        the door is not closed. A robot may then stand in the doorway.
        """
        stands_open = self.mode not in (None, CLOSED)
        return self.may_speak or (self.at_once and stands_open and self.holds_restored)

    @property
    def holds_restored(self) -> bool:
        """Return whether a holder from before our restart holds the door."""
        return any(holder.restored for holder in self.holders)

    @property
    def owed(self) -> bool:
        """Return whether a new request is due. A CLOSE is due only if the last request was OPEN."""
        return self.wanted != self.sent and (self.wanted == OPEN or self.sent == OPEN)

    @property
    def disagrees(self) -> bool:
        """Return whether the door's state contradicts the wanted mode. OFFLINE and UNKNOWN contradict
        nothing."""
        return self.mode == MOVING or self.mode == (CLOSED if self.holders else OPEN)

    @property
    def silent_at(self) -> float:
        """The time when a held door counts as silent; NEVER without a holder."""
        if not self.holders:
            return NEVER
        return max(self.shown_at, self.holders[0].since) + SILENT_S

    def holder(self, requester: str) -> Holder | None:
        """Find this requester among the holders; None if the requester does not hold the door."""
        return next((h for h in self.holders if h.requester == requester), None)
