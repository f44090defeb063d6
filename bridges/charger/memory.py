"""What the charger's core remembers from scan to scan, and the limits that it is given."""

from collections.abc import Mapping
from typing import Literal

import msgspec

from bridges.charger.settings import ChargerSettings, Durations, Robot, Unrequested, robot
from bridges.charger.signals import ChargerSample, Requested
from bridges.core.durations import AGES_AGO, RIVAL_QUIET_S


class ChargerLimits(msgspec.Struct, frozen=True):
    """A charger's fixed facts as its core needs them. `t`: durations and counts.

    `receivers`: empty where nobody is verified. `can_stop`: `power` is obeyed.
    """

    t: Durations = Durations()
    receivers: Mapping[str, Robot] = {}
    unrequested: Unrequested = "refuse"
    can_stop: bool = True

    @classmethod
    def of(
        cls, settings: ChargerSettings, debounce: Mapping[str, float] | None = None
    ) -> "ChargerLimits":
        """From the YAML; a charger has no contacts to debounce."""
        known = {receiver: robot(text) for receiver, text in settings.receivers.items()}
        return cls(settings.limits, known, settings.unrequested, settings.can_stop())


class Session(msgspec.Struct, frozen=True):
    """A request that occupies the station, and how far its charging is.

    `start_by`: charging must have started (monotonic s). `paused_at`: since when another robot on the
    pad keeps it from starting. `checked_at`: when its position was asked for. `started`: current has
    flowed for it. `failed`: the station was at fault since, so there is no power for this request any
    more. `ended`: why it is over; `released_at`: since when it is disconnected.
    """

    request: Requested
    start_by: float
    paused_at: float | None = None
    checked_at: float | None = None
    started: bool = False
    failed: bool = False
    ended: Literal["", "start timeout", "cancelled", "full", "left"] = ""
    released_at: float | None = None

    @property
    def over(self) -> bool:
        """There is no power for it any more, whatever comes."""
        return self.failed or bool(self.ended) or self.released_at is not None


class Memory(msgspec.Struct, frozen=True):
    """Everything that outlives a scan. `sample`: the last good reading, of `read_at`.

    `write_misses`: scans in a row whose commands failed, `write_failed` among them this one.
    `power`: as last decided; `disobeyed_since`: since when the station charges against it.
    `adopted`: it was charging when we came, so whatever is on the pad stays as it is.
    `protection`: why the station is out of service, "" while it is not; `clear_by`: until when a good
    reading shows that a clearing has helped. `over`: the last requests that have ended.
    """

    sample: ChargerSample | None = None
    read_at: float | None = None
    misses: int = 0
    io_fault: str = ""
    write_misses: int = 0
    write_failed: bool = False
    write_fault: str = ""
    holder: Session | None = None
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


def rivalled(memory: Memory, now: float) -> bool:
    """Does another node publish this charger's states?"""
    return now - memory.rival_at < RIVAL_QUIET_S


def unreachable(memory: Memory, limits: ChargerLimits) -> bool:
    """Have `misses` polls failed since the last good reading, or was there none?"""
    return memory.sample is None or memory.misses >= limits.t.misses
