"""What the charger's core remembers from scan to scan, and the limits that it is given."""

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
from bridges.kinds.shared.durations import AGES_AGO, RIVAL_QUIET_S


class ChargerLimits(msgspec.Struct, frozen=True):
    """What the core needs of a charger's settings. `t`: durations and counts.

    `receivers`: receiver id -> robot; empty if robots are not verified. `can_stop`: the station obeys
    `power`.
    """

    t: ChargerDurations = ChargerDurations()
    receivers: Mapping[str, RobotName] = {}
    unrequested: Unrequested = "refuse"
    can_stop: bool = True

    @classmethod
    def of(
        cls, settings: ChargerSettings, debounce: Mapping[str, float] | None = None
    ) -> "ChargerLimits":
        """From the YAML; a charger has no contacts to debounce."""
        known = {receiver: robot(text) for receiver, text in settings.receivers.items()}
        return cls(settings.limits, known, settings.unrequested, settings.can_stop())


class ChargeSession(msgspec.Struct, frozen=True):
    """A request that holds the station, and how far its charge has come.

    `start_by`: when charging must have started (monotonic s). `paused_at`: since when another robot on
    the pad has kept it from starting. `checked_at`: when its robot's position was last asked for.
    `started`: current has flowed for it. `failed`: the station was at fault, so this request gets no
    more power. `ended`: why it is over. `released_at`: since when its robot is disconnected.
    """

    request: ChargeRequested
    start_by: float
    paused_at: float | None = None
    checked_at: float | None = None
    started: bool = False
    failed: bool = False
    ended: Literal["", "start timeout", "cancelled", "full", "left"] = ""
    released_at: float | None = None

    @property
    def over(self) -> bool:
        """This request gets no more power."""
        return self.failed or bool(self.ended) or self.released_at is not None


class ChargerMemory(msgspec.Struct, frozen=True):
    """Everything that outlives a scan. `sample`: the last good reading, taken at `read_at`.

    `misses`: polls that failed in a row. `write_misses`: scans in a row whose commands failed;
    `write_failed`: this scan's did. `power`: as last decided; `disobeyed_since`: since when the station
    charges although `power` is off. `adopted`: the station was charging when we reached it, and that
    charge is left alone. `protection`: why the station is out of service, "" while it is in service;
    `clear_by`: until when a good reading proves that a clearing has helped. `over`: the last requests
    that have ended.
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


def rivalled(memory: ChargerMemory, now: float) -> bool:
    """Does another node publish this charger's states?"""
    return now - memory.rival_at < RIVAL_QUIET_S


def unreachable(memory: ChargerMemory, limits: ChargerLimits) -> bool:
    """Have `misses` polls failed since the last good reading, or has there been no reading yet?"""
    return memory.sample is None or memory.misses >= limits.t.misses
