"""The door core's memory from scan to scan, and its limits."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from bridges.kinds.door.settings import DoorDurations, DoorSettings, Pulse
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S


class DoorLimits(msgspec.Struct, frozen=True):
    """The settings of a door that its core needs.

    `t`: the durations. `debounce` maps a signal to its debounce (s). `estimated`: the time since the
    hold was switched replaces a missing limit contact.
    """

    t: DoorDurations = DoorDurations()
    debounce: Mapping[str, float] = {}
    estimated: bool = False
    on_fire: Literal["open", "release"] = "release"
    pulse: Pulse | None = None

    @classmethod
    def of(cls, settings: DoorSettings, debounce: Mapping[str, float]) -> "DoorLimits":
        """Make the limits from the YAML and the wiring table's debounce (signal -> s)."""
        return cls(
            settings.limits,
            debounce,
            settings.feedback == "estimated",
            settings.on_fire or "release",
            settings.pulse,
        )


Contact = Settled[bool | None]
"""One debounced input. An input that is not wired has the value None and the candidate None."""


class DoorSenses(msgspec.Struct, frozen=True):
    """The door's contacts. Each is None before its first reading.

    `read_at`: the time of the last reading. `linked_since`: every read and write has succeeded since
    this time; None after a failure. `lost`, `errors`: from the last `DoorSample`.
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
    """The facts of the past that the next decision needs. Times are monotonic seconds.

    `latched_at`: RMF has wanted the door open since this time. `close_at`: the time when a CLOSE
    releases the hold. `held`: the hold is on. `held_since`: the time when the hold was last switched.
    `closing`: since the end of the hold, the door has not been seen closed. `between_since`: the door
    has been between its end positions since this time. `shut_since`: the door has not been fully open
    since this time. `rival_at`: the time when another node for this door was last heard.
    `unattended_since`: no node has published requests since this time.
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
    """Return whether another node publishes this door's states."""
    return memory.rival_at is not None and now < memory.rival_at + RIVAL_QUIET_S


def travel_ends_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time by which a door between its end positions must have arrived; NEVER for a door at
    an end position.

    Switching the hold restarts the allowed time, `travel_s`.
    """
    if memory.between_since is None:
        return NEVER
    return max(memory.between_since, memory.held_since) + limits.t.travel_s


def opening_ends_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time by which a held door must be open; NEVER for an open door, and without a hold."""
    if memory.shut_since is None or not memory.held:
        return NEVER
    return max(memory.shut_since, memory.held_since) + limits.t.open_timeout_s


def too_long_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time when RMF will have held the door for `max_hold_s`; NEVER without a limit or a
    hold."""
    if memory.latched_at is None or limits.t.max_hold_s is None:
        return NEVER
    return memory.latched_at + limits.t.max_hold_s


def lost_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time when the hold ends because no supervisor is present. Return NEVER if a supervisor
    is present, or without `supervisor_lost_s`."""
    if memory.unattended_since is None or limits.t.supervisor_lost_s is None:
        return NEVER
    return memory.unattended_since + limits.t.supervisor_lost_s
