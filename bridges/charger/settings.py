"""The part of a charger's YAML that does not depend on how it is reached."""

from collections.abc import Iterator
from typing import Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

from bridges.core.fields import DeviceSettings, Name, Seconds

Misses = Annotated[int, Meta(ge=1, le=100)]
PerHour = Annotated[int, Meta(ge=0, le=60, extra={"unit": "per hour"})]
StartTimeout = Annotated[float, Meta(ge=1, le=86400, extra={"unit": "s"})]
StopTimeout = Annotated[float, Meta(ge=1, le=600, extra={"unit": "s"})]
Released = Annotated[float, Meta(ge=1, le=60, extra={"unit": "s"})]
Percent = Annotated[float, Meta(ge=50, le=100, extra={"unit": "%"})]
ReceiverId = Annotated[
    str,
    Meta(
        min_length=1, max_length=64, pattern=r"^[!-~]+$", extra={"pattern": "text without spaces"}
    ),
]
Unrequested = Literal["serve_known", "refuse"]


class Robot(NamedTuple):
    """A robot as RMF names it."""

    fleet: str
    name: str

    def __str__(self) -> str:
        return f"{self.fleet}/{self.name}"


def robot(text: str) -> Robot:
    """FLEET/ROBOT in its parts. Raises ValueError."""
    fleet, slash, name = text.partition("/")
    if not (fleet and slash and name):
        raise ValueError(f"{text!r} is no robot: write FLEET/ROBOT, as RMF names them")
    return Robot(fleet, name)


class Durations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and counts of a charger.

    `misses`: failed polls in a row after which the charger is shown as unreachable; failed commands
    too.
    `start_timeout_s`: how long a request waits for charging to start where it does not say.
    `stop_timeout_s`: how long a station may go on charging that was told to stop, before it is taken
    out of service.
    `released_s`: how long RELEASED is shown at the least; states go out at 1 Hz, so not below 1 s.
    `full_percent`: a battery as full as this is released, where the station knows how full it is.
    `clear_errors_per_h`: how often the daemon may clear the station's errors by itself; 0 is never.
    `peer_internal_timeout_s`: after how long without us the station is certain to have switched off
    by itself; only with it can an operator free a station that does not answer.
    """

    misses: Misses = 3
    start_timeout_s: StartTimeout = 300.0
    stop_timeout_s: StopTimeout = 30.0
    released_s: Released = 2.0
    full_percent: Percent = 100.0
    clear_errors_per_h: PerHour = 0
    peer_internal_timeout_s: Seconds | None = None


class ChargerSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every charger has, whatever its driver.

    `limits`: durations and counts, where the defaults do not suit.
    `receivers`: receiver id -> FLEET/ROBOT: whose receiver the station sees. With it, only the robot
    that the station is assigned to is charged.
    `unrequested`: a robot of `receivers` that turns up without a request: `serve_known` charges it,
    `refuse` does not, and says who it is.
    `on_death`: what the daemon's end means for a charge under way: `stop` it, or `keep` it.
    """

    limits: Durations = Durations()
    receivers: dict[ReceiverId, Name] = msgspec.field(default_factory=dict)
    unrequested: Unrequested = "refuse"
    on_death: Literal["stop", "keep"] = "stop"

    def can_stop(self) -> bool:
        """Can this station be told to stop? A driver whose station cannot says so."""
        return True

    def problems(self) -> Iterator[tuple[tuple[str, ...], str]]:
        """Names that are no FLEET/ROBOT. A robot may have two receivers: one may be a spare."""
        for receiver, text in self.receivers.items():
            try:
                robot(text)
            except ValueError as error:
                yield ("receivers", receiver), str(error)
        if self.unrequested == "serve_known" and not self.receivers:
            yield ("unrequested",), "serve_known needs receivers: whom does the station know?"
