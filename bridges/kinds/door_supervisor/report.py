"""Doors and their holders: in the heartbeat, in the log and in the status file.

Fleet adapters rely on the heartbeat. Their phase DoorOpen ends only when the heartbeat lists the robot.
Their phase DoorClose ends only when the heartbeat no longer lists the robot. If the heartbeat lists a
robot for a door that the robot does not hold, the adapter sends CLOSE (rmf_ros2, RobotContext.cpp
_check_door_supervisor).

RMF's own supervisor sends the heartbeat only after adapter requests. Therefore that heartbeat lists the
robots of a restarted fleet adapter for ever. Our supervisor sends the heartbeat after requests, and
each second.
"""

from collections.abc import Iterator, Mapping

import msgspec

from bridges.kinds.door_supervisor.memory import DoorSupervisorLimits, Holder, SupervisedDoor
from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.freshness import SECOND_NS
from bridges.messages.definitions import (
    DoorModeValue,
    DoorSessions,
    Session,
    SupervisorHeartbeat,
    Time,
)
from bridges.messages.topics import DOOR_SUPERVISOR_HEARTBEAT, AnyTopic


class DoorHoldReport(msgspec.Struct, frozen=True):
    """One door, for the log and the status file. Times are monotonic seconds.

    `holders`: pairs of a requester and the time since which it holds the door. `mode`: the door's last
    mode, heard at `read_at`. `waits`: the reason why we send nothing to a held door; else "".
    """

    read_at: float | None
    mode: DoorModeValue | None = None
    holders: tuple[tuple[str, float], ...] = ()
    faults: tuple[Fault, ...] = ()
    waits: str = ""

    def news(self) -> object:
        """Return the facts whose change is logged."""
        return self.mode, tuple(requester for requester, _ in self.holders)


def report(memory: SupervisedDoor, now: float, limits: DoorSupervisorLimits) -> DoorHoldReport:
    """Report the present state of one door."""
    return DoorHoldReport(
        read_at=None if memory.mode is None else memory.shown_at,
        mode=memory.mode,
        holders=tuple((holder.requester, holder.since) for holder in memory.holders),
        faults=tuple(_faults(memory, now, limits)),
        waits=memory.passive if memory.holders and not memory.may_send else "",
    )


def _faults(memory: SupervisedDoor, now: float, limits: DoorSupervisorLimits) -> Iterator[Fault]:
    late = [h.requester for h in memory.holders if now >= h.since + limits.open_alarm_s]
    if late:
        yield Fault("DOOR_HELD_OPEN", f"longer than {limits.open_alarm_s:g} s by {', '.join(late)}")
    if now >= memory.silent_at:
        yield Fault("DOOR_SILENT", "no DoorState comes")


def heartbeat(memories: Mapping[str, SupervisedDoor]) -> tuple[AnyTopic, SupervisorHeartbeat]:
    """List all held doors and their holders. Doors and holders are in the order of their names."""
    doors = tuple(
        DoorSessions(name, tuple(map(_session, by_name(memory))))
        for name, memory in sorted(memories.items())
        if memory.holders
    )
    return DOOR_SUPERVISOR_HEARTBEAT, SupervisorHeartbeat(doors)


def by_name(memory: SupervisedDoor) -> list[Holder]:
    """Sort the door's holders by name."""
    return sorted(memory.holders, key=lambda holder: holder.requester)


def _session(holder: Holder) -> Session:
    sec, nanosec = divmod(holder.stamp, SECOND_NS)
    return Session(Time(sec, nanosec), holder.requester)
