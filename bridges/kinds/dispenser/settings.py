"""The part of a dispenser's or ingestor's YAML that does not depend on its wiring."""

from collections.abc import Iterator
from typing import Annotated

import msgspec
from msgspec import Meta

from bridges.kinds.shared.fields import Brief, DeviceSettings, Name, Patience, Timeout, tells
from bridges.kinds.shared.remarks import Remarks

StaleAfter = Annotated[float, Meta(ge=0.1, le=60, extra={"unit": "s"})]
Pulse = Annotated[float, Meta(ge=0.05, le=60, extra={"unit": "s"})]
Quantity = Annotated[int, Meta(ge=1, le=65535)]


class WorkcellDurations(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations of a dispenser or ingestor."""

    stale_after_s: Annotated[
        StaleAfter,
        tells("""the time without a good reading after which the state is OFFLINE and the output
        `start` is off."""),
    ] = 1.0
    cycle_limit_s: Annotated[
        Timeout,
        tells("how long one cycle may take; a cycle without `done` in this time has FAILED."),
    ] = 120.0
    settle_s: Annotated[
        Brief,
        tells("how long `done` may follow the end of `busy`; after that the cycle has FAILED."),
    ] = 1.0
    asked_within_s: Annotated[
        Patience,
        tells("""a cycle starts only if RMF has repeated its request within this time. If RMF has
        not, the robot may be gone."""),
    ] = 5.0
    repeats_within_s: Annotated[
        Patience,
        tells("""how long RMF may be silent about a finished request; a repeat after that is in
        doubt, because RMF may have given its number to another task."""),
    ] = 300.0


class AskedFor(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One sort of item that RMF may ask for."""

    most: Annotated[Quantity, tells("the greatest quantity in one request.")] = 1
    compartments: Annotated[
        list[Name],
        tells("the compartments that a request may name; when absent, a request names none."),
    ] = []


class WorkcellSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of one dispenser or ingestor, except its wiring."""

    limits: Annotated[
        WorkcellDurations, tells("the durations that differ from their defaults.")
    ] = WorkcellDurations()
    items: Annotated[
        dict[Name, AskedFor],
        tells("""type_guid of an item -> the quantity and compartments that a request for it may
        name. A request for any other item is answered FAILED. When absent, requests carry no
        items."""),
    ] = msgspec.field(default_factory=dict)
    pulse_s: Annotated[
        Pulse | None,
        tells("""how long the output `start` is on; when absent, `start` stays on until `done`, a
        fault or the limit."""),
    ] = None

    def stale_after(self) -> float:
        """Return `stale_after_s` of the limits."""
        return self.limits.stale_after_s

    def awaited(self) -> Iterator[tuple[str, str, str]]:
        """Yield the inputs for which the workcell's limits wait."""
        yield "done", "settle_s", "busy"
        yield "done", "cycle_limit_s", ""

    def problems(self) -> Remarks:
        """Yield the fields that contradict each other."""
        if self.pulse_s is not None and self.pulse_s >= self.limits.cycle_limit_s:
            yield (
                ("pulse_s",),
                "must be shorter than cycle_limit_s; delete the key if the output must stay on",
            )
        if self.limits.repeats_within_s < self.limits.asked_within_s:
            yield ("limits", "repeats_within_s"), "must not be shorter than asked_within_s"
