"""The values that the charger core keeps from one scan to the next, and the settings that it needs (its
limits)."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from bridges.kinds.charger.settings import (
    ChargerDurations,
    ChargerSettings,
    RobotName,
    Unrequested,
    robot,
)
from bridges.kinds.charger.signals import ChargeRequested, ChargerSample
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.durations import AGES_AGO, RIVAL_QUIET_S


class ChargerLimits(msgspec.Struct, frozen=True):
    """The settings of a charger that its core needs. `t`: durations and counts.

    A receiver is the part of a robot that takes the power. `receivers` maps a receiver's id to its
    robot, and is empty if robots are not verified. `can_stop`: the station obeys `power`. `debounce`:
    the debounce (s) of each contact; empty for a station without contacts.
    """

    t: ChargerDurations = ChargerDurations()
    receivers: Mapping[str, RobotName] = {}
    unrequested: Unrequested = "refuse"
    can_stop: bool = True
    debounce: Mapping[str, float] = {}

    @classmethod
    def of(
        cls, settings: ChargerSettings, debounce: Mapping[str, float] | None = None
    ) -> "ChargerLimits":
        """Make the limits from the YAML and from the debounce (s) of each contact."""
        known = {receiver: robot(text) for receiver, text in settings.receivers.items()}
        can_stop = settings.can_stop()
        return cls(settings.limits, known, settings.unrequested, can_stop, debounce or {})


class ChargeSession(msgspec.Struct, frozen=True):
    """The request to which the station is assigned, and the progress of its charge.

    `start_by`: the charge must start by this time (monotonic s). `paused_at`: another robot on the pad
    has prevented the start since this time. `checked_at`: the time of the last range check.
    `check_is_void`: the robot has left the pad since then, or the order was not written. `started`:
    current has flowed for this request. `flowed_at`: the present or last charge began at this time;
    None if the daemon did not see it begin. `failed`: the station reported a fault, so this request
    gets no more power. `ended`: the reason why the request ended. `released_at`: the time at which the
    robot was disconnected.
    """

    request: ChargeRequested
    start_by: float
    paused_at: float | None = None
    checked_at: float | None = None
    check_is_void: bool = False
    started: bool = False
    failed: bool = False
    ended: Literal["", "start timeout", "cancelled", "full", "left"] = ""
    released_at: float | None = None
    flowed_at: float | None = None

    @property
    def over(self) -> bool:
        """Return whether this request gets no more power."""
        return self.failed or bool(self.ended) or self.released_at is not None


class ChargerMemory(msgspec.Struct, frozen=True):
    """The memory of one charger from one scan to the next.

    `sample`: the last good reading, at `read_at`. `misses`: the number of failed polls in a row.
    `write_misses`: the number of scans in a row with failed commands. `write_failed`: a command failed
    in this scan. `over`: the ids of the latest ended requests. `adopted`: the station was charging when
    the daemon reached it, and the daemon does not stop that charge. `power`: the power that the core
    last ordered. `disobeyed_since`: the station has charged since this time although it was told to
    stop. `protection`: the reason why the station is out of service, "" in service. `clear_by`: a good
    reading up to this time proves that the errors were cleared. `contacts`: the debounced reading of a
    station on contacts; None while it is not known, and for every other station.
    """

    sample: ChargerSample | None = None
    read_at: float | None = None
    misses: int = 0
    io_fault: str = ""
    write_misses: int = 0
    write_failed: bool = False
    write_fault: str = ""
    holder: ChargeSession | None = None
    over: tuple[str, ...] = ()
    adopted: bool = False
    power: bool | None = None
    disobeyed_since: float | None = None
    protection: str = ""
    clear_by: float = AGES_AGO
    clear_errors: int = 0
    cleared_at: float = AGES_AGO
    range_checks: int = 0
    rival_at: float = AGES_AGO
    contacts: Settled[ChargerSample] | None = None


def rivalled(memory: ChargerMemory, now: float) -> bool:
    """Return whether another node publishes this charger's states."""
    return now - memory.rival_at < RIVAL_QUIET_S


def unreachable(memory: ChargerMemory, limits: ChargerLimits) -> bool:
    """Return whether the station cannot be reached. That is so before the first reading, and after
    `misses` failed polls in a row."""
    return memory.sample is None or memory.misses >= limits.t.misses
