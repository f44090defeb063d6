"""The doors' holders (requesters that want a door open), saved across a restart.

A holder is saved before the heartbeat lists the holder, because a robot drives on as soon as it is
listed.
"""

from collections.abc import Mapping
from typing import Annotated, Final

import msgspec
from msgspec import Meta

from bridges.kinds.door_supervisor.memory import Holder, SupervisedDoor
from bridges.kinds.door_supervisor.report import by_name
from bridges.kinds.door_supervisor.settings import DoorSupervisorSettings
from bridges.kinds.shared import keep
from bridges.kinds.shared.freshness import SECOND_NS, Requester
from bridges.kinds.shared.keep import Text

VERSION: Final = 1
Stamp = Annotated[int, Meta(ge=0, lt=2**31 * SECOND_NS)]


class KeptDoors(keep.Kept, frozen=True, forbid_unknown_fields=True):
    """The saved holders. `doors` maps a door to its holders, and each holder to a stamp (ns). This is
    the stamp of the OPEN with which the holder came to the door."""

    doors: dict[Text, dict[Text, Stamp]]


def persist(memories: Mapping[str, SupervisedDoor]) -> bytes:
    """Encode the holders for the next start. The bytes change only when a holder comes or goes."""
    doors = {
        name: {holder.requester: holder.visit for holder in by_name(memory)}
        for name, memory in sorted(memories.items())
        if memory.holders
    }
    return msgspec.json.encode(KeptDoors(VERSION, doors))


def restore(kept: bytes, settings: DoorSupervisorSettings, now: float) -> dict[str, SupervisedDoor]:
    """Make the memories at start from the bytes of `persist`, for the doors that the supervisor still
    serves.

    Raises ValueError for bytes that `persist` did not make. The time of every hold starts again at
    `now`, because monotonic times from before the restart mean nothing.
    """
    found = keep.read(kept, KeptDoors, VERSION, "a table of doors and their holders")
    served = found.doors if settings.doors is None else set(settings.doors)
    return {
        door: _restored(door, holders, now)
        for door, holders in found.doors.items()
        if door in served
    }


def _restored(door: str, holders: Mapping[str, int], now: float) -> SupervisedDoor:
    return SupervisedDoor(
        door,
        holders=tuple(
            Holder(who, now, now, stamp, stamp, restored=True) for who, stamp in holders.items()
        ),
        requesters={who: Requester(stamp, heard_at=now) for who, stamp in holders.items()},
    )
