"""Who holds which door, over all doors: RMF's heartbeat, and what a restart must not forget.

Fleet adapters rely on the heartbeat: DoorOpen ends only when it lists its robot, DoorClose when it
does not, and a robot that is listed for a door it does not hold sends CLOSE (rmf_ros2,
RobotContext.cpp _check_door_supervisor). RMF's own sends it on adapter requests alone, so a session
of a fleet adapter that was restarted stays for ever; ours goes out each second as well.

What is kept is kept before the heartbeat that tells it: a robot drives on by the heartbeat.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Final

import msgspec
from msgspec import Meta

from bridges.door_supervisor.core import Holder, Memory
from bridges.door_supervisor.messages import SECOND_NS
from bridges.door_supervisor.settings import Settings
from bridges.door_supervisor.voice import Voice
from bridges.rmf.definitions import DoorSessions, Session, SupervisorHeartbeat, Time
from bridges.rmf.topics import DOOR_SUPERVISOR_HEARTBEAT, Topic

Stamp = Annotated[int, Meta(ge=0, lt=2**31 * SECOND_NS)]
Text = Annotated[str, Meta(min_length=1)]


class Kept(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file: door -> requester -> the stamp (ns) of its present visit's first OPEN."""

    version: int
    doors: dict[Text, dict[Text, Stamp]]


VERSION: Final = 1


def heartbeat(memories: Mapping[str, Memory]) -> tuple[Topic[Any], SupervisorHeartbeat]:
    """All doors that somebody holds, and by whom, in the order of names."""
    doors = tuple(
        DoorSessions(
            name,
            tuple(Session(_time(h.stamp), h.requester) for h in sorted(memory.holders, key=_name)),
        )
        for name, memory in sorted(memories.items())
        if memory.holders
    )
    return DOOR_SUPERVISOR_HEARTBEAT, SupervisorHeartbeat(doors)


def persist(memories: Mapping[str, Memory]) -> bytes:
    """What the next start needs; the same bytes as long as nobody comes or goes."""
    doors = {
        name: {h.requester: h.visit for h in sorted(memory.holders, key=_name)}
        for name, memory in sorted(memories.items())
        if memory.holders
    }
    return msgspec.json.encode(Kept(VERSION, doors))


def restore(kept: bytes, settings: Settings, now: float) -> dict[str, Memory]:
    """The memories at start, from what `persist` gave, for the doors still served.

    ValueError if it is not that. How long each has held its door is counted anew: the clock that it
    was counted by is gone.
    """
    try:
        table = msgspec.json.decode(kept, type=Kept)
    except msgspec.MsgspecError as error:
        raise ValueError(f"not a table of who holds which door: {error}") from error
    if table.version != VERSION:
        raise ValueError(f"version {table.version} of the table; this is for {VERSION}")
    served = table.doors if settings.doors is None else set(settings.doors)
    return {
        door: _restored(door, holders, now)
        for door, holders in table.doors.items()
        if door in served
    }


def _restored(door: str, holders: Mapping[str, int], now: float) -> Memory:
    return Memory(
        door,
        holders=tuple(Holder(who, now, now, stamp, stamp) for who, stamp in holders.items()),
        voices={who: Voice(stamp, now) for who, stamp in holders.items()},
    )


def _name(holder: Holder) -> str:
    return holder.requester


def _time(stamp: int) -> Time:
    sec, nanosec = divmod(stamp, SECOND_NS)
    return Time(sec, nanosec)
