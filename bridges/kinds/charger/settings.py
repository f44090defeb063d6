"""The part of a charger's YAML that does not depend on its driver."""

from typing import Annotated, Literal, NamedTuple

import msgspec
from msgspec import Meta

from bridges.kinds.shared.fields import DeviceSettings, Name, Seconds, tells
from bridges.kinds.shared.remarks import Remarks

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


class RobotName(NamedTuple):
    """A robot's names in RMF."""

    fleet: str
    name: str

    def __str__(self) -> str:
        return f"{self.fleet}/{self.name}"


def robot(text: str) -> RobotName:
    """Split FLEET/ROBOT into its parts. Raises ValueError for any other form."""
    fleet, slash, name = text.partition("/")
    if not (fleet and slash and name):
        raise ValueError(
            f"{text!r} is not a robot: write FLEET/ROBOT, with the names that RMF uses"
        )
    return RobotName(fleet, name)


class ChargerDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and counts of a charger."""

    misses: Annotated[
        Misses,
        tells("""the number of failed polls in a row after which the charger is shown as unreachable.
        After as many failed commands in a row the charger is shown as one that takes no commands."""),
    ] = 3
    start_timeout_s: Annotated[
        StartTimeout, tells("how long charging may take to start, if the request gives no time.")
    ] = 300.0
    stop_timeout_s: Annotated[
        StopTimeout,
        tells("""how long a station may go on charging after an order to stop. After that the station
        is out of service."""),
    ] = 30.0
    released_s: Annotated[
        Released,
        tells("""the least time for which the state RELEASED is shown. RMF gets states once a
        second, so a shorter time could hide the state."""),
    ] = 2.0
    full_percent: Annotated[
        Percent,
        tells(
            "the battery's charge at which a robot is released, if the station reports the charge."
        ),
    ] = 100.0
    clear_errors_per_h: Annotated[
        PerHour, tells("how often the daemon itself may clear the station's errors; 0: never.")
    ] = 0
    peer_internal_timeout_s: Annotated[
        Seconds | None,
        tells("""the time after which a station that does not hear from the daemon has certainly
        switched itself off. When absent, an operator cannot free a station that does not answer."""),
    ] = None


class ChargerSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of every charger, whatever its driver."""

    limits: Annotated[ChargerDurations, tells("the limits that differ from their defaults.")] = (
        ChargerDurations()
    )
    receivers: Annotated[
        dict[ReceiverId, Name],
        tells("""receiver id -> FLEET/ROBOT of the robot that carries the receiver. With this table a
        station charges only its assigned robot."""),
    ] = msgspec.field(default_factory=dict)
    unrequested: Annotated[
        Unrequested,
        tells("""how the station treats a robot of `receivers` that stands on the pad without a
        request. `serve_known` charges the robot; `refuse` only reports its name."""),
    ] = "refuse"
    on_death: Annotated[
        Literal["stop", "keep"],
        tells("""the effect on a present charge when the daemon ends: `stop` ends the charge,
        `keep` continues it."""),
    ] = "stop"

    def can_stop(self) -> bool:
        """Return whether this station obeys an order to stop. The drivers of stations that do not obey
        override this method."""
        return True

    def problems(self) -> Remarks:
        """Yield a problem for each name that does not have the form FLEET/ROBOT. Two receivers may
        belong to the same robot, because a robot may have a spare."""
        for receiver, text in self.receivers.items():
            try:
                robot(text)
            except ValueError as error:
                yield ("receivers", receiver), str(error)
        if self.unrequested == "serve_known" and not self.receivers:
            yield ("unrequested",), "serve_known needs receivers: without them no robot is known"
