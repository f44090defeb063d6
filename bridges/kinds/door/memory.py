"""What the door's core remembers from scan to scan, and the limits that it is given."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from bridges.kinds.door.settings import DoorDurations, DoorSettings, Pulse
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S


class DoorLimits(msgspec.Struct, frozen=True):
    """What the core needs of a door's settings. `t`: the durations. `debounce`: signal -> s.

    `estimated`: a missing limit contact is estimated by time.
    """

    t: DoorDurations = DoorDurations()
    debounce: Mapping[str, float] = {}
    estimated: bool = False
    on_fire: Literal["open", "release"] = "release"
    pulse: Pulse | None = None

    @classmethod
    def of(cls, settings: DoorSettings, debounce: Mapping[str, float]) -> "DoorLimits":
        """From the YAML, and from the wiring table's debounce (signal -> s)."""
        return cls(
            settings.limits,
            debounce,
            settings.feedback == "estimated",
            settings.on_fire or "release",
            settings.pulse,
        )


Contact = Settled[bool | None]
"""One debounced input. If it is not wired, its value and its candidate are None."""


class DoorSenses(msgspec.Struct, frozen=True):
    """Each contact; None before it was first read.

    `read_at`: when all were last read. `linked_since`: since when no read or write has failed; None
    while one has. `lost`, `errors`: those of the last `DoorSample`.
    """

    opened: Contact | None = None
    closed: Contact | None = None
    obstruction: Contact | None = None
    fire: Contact | None = None
    read_at: float | None = None
    linked_since: float | None = None
    lost: str = ""
    errors: tuple[str, ...] = ()


class DoorMemory(msgspec.Struct, frozen=True):
    """Everything that the next decision needs to know of the past. Times are monotonic seconds.

    `latched_at`: since when RMF wants the door open. `close_at`: when a CLOSE releases the hold.
    `held`: the hold is on; `held_since`: when it was last switched on or off. `closing`: the hold has
    ended, and the door has not been seen closed since. `between_since`: since when the door is at
    neither end position. `shut_since`: since when it is not fully open. `unattended_since`: since when
    no node publishes door requests.
    """

    latched_at: float | None = None
    close_at: float | None = None
    held: bool = False
    held_since: float = 0.0
    closing: bool = False
    senses: DoorSenses = DoorSenses()
    between_since: float | None = None
    shut_since: float | None = None
    rival_at: float | None = None
    io_failure: str = ""
    unattended_since: float | None = None


def rivalled(memory: DoorMemory, now: float) -> bool:
    """Does another node publish this door's states?"""
    return memory.rival_at is not None and now < memory.rival_at + RIVAL_QUIET_S


def travel_ends_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """When a door at neither end position has taken too long; a change of the hold restarts the
    time."""
    if memory.between_since is None:
        return NEVER
    return max(memory.between_since, memory.held_since) + limits.t.travel_s


def opening_ends_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """When a held door should have opened; NEVER if it is open or not held."""
    if memory.shut_since is None or not memory.held:
        return NEVER
    return max(memory.shut_since, memory.held_since) + limits.t.open_timeout_s


def too_long_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """When RMF will have held the door for `max_hold_s`; NEVER if there is no such limit."""
    if memory.latched_at is None or limits.t.max_hold_s is None:
        return NEVER
    return memory.latched_at + limits.t.max_hold_s


def lost_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """When the supervisor has been gone for `supervisor_lost_s`; NEVER if there is no such limit."""
    if memory.unattended_since is None or limits.t.supervisor_lost_s is None:
        return NEVER
    return memory.unattended_since + limits.t.supervisor_lost_s
