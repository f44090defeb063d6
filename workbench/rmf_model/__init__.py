"""RMF's supervisors and fleet adapters as rules, so that `judge` and the tests can play them.

Taken from rmf_ros2 9dedd0f (2026-05), with its quirks: nothing here times out, retries or looks at a
lift's mode.

No I/O and no clock: each party hears a message or is ticked at its `wake_at`, and returns what it
publishes. `now` is RMF's clock in seconds (since the epoch, where stamps matter). A
restarted party is a new object.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final

from bridges.messages import definitions as d
from bridges.messages.stamps import stamp
from bridges.messages.topics import AnyTopic

Said = tuple[AnyTopic, d.Message]
"""One message and the topic that it is published on."""

NEVER: Final = float("inf")


class Party(ABC):
    """A node on RMF's side. Some have no timer."""

    subscribes: Sequence[AnyTopic]

    @abstractmethod
    def hear(self, message: d.Message, now: float) -> list[Said]:
        """A message has arrived on one of the topics subscribed."""

    def tick(self, now: float) -> list[Said]:
        """The timer that was due at `wake_at` fires."""
        return []

    def wake_at(self) -> float:
        """When a timer is due next: s, or inf."""
        return NEVER


def door_request(door: str, requester: str, mode: d.DoorModeValue, now: float) -> d.DoorRequest:
    """A DoorRequest as RMF's nodes build it."""
    return d.DoorRequest(stamp(now), requester, door, d.DoorMode(int(mode)))


def has_session(heartbeat: d.SupervisorHeartbeat, requester: str, door: str) -> bool:
    """Does the heartbeat list this requester for this door? (SupervisorHasSession.cpp)"""
    return any(
        sessions.door_name == door and session.requester_id == requester
        for sessions in heartbeat.all_sessions
        for session in sessions.sessions
    )
