"""The values that the door core keeps from one scan to the next, and the settings that it needs (its
limits)."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from bridges.kinds.door.pulses import DoorPulses
from bridges.kinds.door.settings import DoorDurations, DoorSettings, Pulse
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S


class DoorLimits(msgspec.Struct, frozen=True):
    """The settings of a door that its core needs.

    `t`: the durations. `debounce` maps a signal to its debounce (s). `estimated`: if a limit contact is
    missing, estimate the door's position from the time since the hold was switched.
    """

    t: DoorDurations = DoorDurations()
    debounce: Mapping[str, float] = {}
    estimated: bool = False
    on_fire: Literal["open", "release"] = "release"
    pulse: Pulse | None = None

    @classmethod
    def of(cls, settings: DoorSettings, debounce: Mapping[str, float]) -> "DoorLimits":
        """Make the limits from the YAML and from `debounce`, which maps each wired signal to its
        debounce (s)."""
        return cls(
            settings.limits,
            debounce,
            settings.feedback == "estimated",
            settings.on_fire or "release",
            settings.pulse,
        )


Contact = Settled[bool | None]
"""One debounced input. If an input is not wired, both its settled value and its newest reading
(`candidate`) are None."""


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
    releases the hold. `held`: the hold (the output that keeps the door open) is on. `held_since`: the
    time when the hold was last switched. `closing`: the hold has ended, and the door has not been seen
    closed since then. `between_since`: the door has been between its end positions since this time.
    `shut_since`: the door has not been fully open since this time. `rival_at`: the time when another
    node for this door was last heard. `unattended_since`: no node has published requests since this
    time. `unwritten_since`: since this time the door was read, but no write has succeeded.
    `write_failed`: the last scan's write failed. `pulses`: the pulses of the present hold; None for a
    door that is not held, or that needs no pulses.
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
    unwritten_since: float | None = None
    write_failed: bool = False
    pulses: DoorPulses | None = None


def unwritten_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time when failed writes become a fault; NEVER after a successful write."""
    since = memory.unwritten_since
    return NEVER if since is None else since + limits.t.stale_after_s


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
    """Return the time by which a held door must be open. Return NEVER if the door is open or not
    held."""
    if memory.shut_since is None or not memory.held:
        return NEVER
    return max(memory.shut_since, memory.held_since) + limits.t.open_timeout_s


def too_long_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time when RMF will have held the door for `max_hold_s`. Return NEVER without a limit,
    and for a door that RMF does not hold."""
    if memory.latched_at is None or limits.t.max_hold_s is None:
        return NEVER
    return memory.latched_at + limits.t.max_hold_s


def lost_at(memory: DoorMemory, limits: DoorLimits) -> float:
    """Return the time when the hold ends because no node publishes door requests. Return NEVER if a
    node publishes them, or without `supervisor_lost_s`."""
    if memory.unattended_since is None or limits.t.supervisor_lost_s is None:
        return NEVER
    return memory.unattended_since + limits.t.supervisor_lost_s
