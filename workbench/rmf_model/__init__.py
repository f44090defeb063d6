"""RMF's supervisors and fleet adapters as rules, so that `judge` and the tests can play RMF's part.

The rules come from rmf_ros2 9dedd0f (2026-05). RMF's weaknesses are included: RMF has no timeouts and
no retries, and ignores a lift's mode.

The module has no I/O and no clock. The caller passes messages to a node (`hear`), and calls `tick` at
`wake_at`. Both return the messages to publish. `now` is the time (s) by RMF's clock. If a node stamps
its messages, `now` must count since the epoch. To restart a node, make a new object.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final

from bridges.messages import definitions as d
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic

Said = tuple[AnyTopic, d.Message]
"""One message and its topic."""

NEVER: Final = float("inf")


class Party(ABC):
    """A node on RMF's side. Without a timer, `tick` does nothing."""

    subscribes: Sequence[AnyTopic]

    @abstractmethod
    def hear(self, message: d.Message, now: float) -> list[Said]:
        """Take a message from one of the subscribed topics."""

    def tick(self, now: float) -> list[Said]:
        """Fire the timer that is due at `wake_at`."""
        return []

    def wake_at(self) -> float:
        """Time (s) of the next timer, or inf without a timer."""
        return NEVER


def door_request(door: str, requester: str, mode: d.DoorModeValue, now: float) -> d.DoorRequest:
    """Build a DoorRequest as RMF's nodes do."""
    return d.DoorRequest(stamp(now), requester, door, d.DoorMode(int(mode)))


def has_session(heartbeat: d.SupervisorHeartbeat, requester: str, door: str) -> bool:
    """Return whether the heartbeat lists this requester for this door (SupervisorHasSession.cpp)."""
    return any(
        sessions.door_name == door and session.requester_id == requester
        for sessions in heartbeat.all_sessions
        for session in sessions.sessions
    )
