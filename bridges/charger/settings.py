"""The part of a charger's YAML that does not depend on how it is reached."""

from typing import Annotated

import msgspec
from msgspec import Meta

from bridges.fields import DeviceSettings

Misses = Annotated[int, Meta(ge=1, le=100)]
PerHour = Annotated[int, Meta(ge=0, le=60, extra={"unit": "per hour"})]
StartTimeout = Annotated[float, Meta(ge=1, le=86400, extra={"unit": "s"})]
Released = Annotated[float, Meta(ge=1, le=60, extra={"unit": "s"})]


class Limits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Durations and counts of a charger.

    `misses`: failed polls in a row after which the charger is shown as unreachable.
    `start_timeout_s`: how long a request waits for charging to start where it does not say.
    `released_s`: how long RELEASED is shown at the least; states go out at 1 Hz, so not below 1 s.
    `clear_errors_per_h`: how often the daemon may clear the station's errors by itself; 0 is never.
    """

    misses: Misses = 3
    start_timeout_s: StartTimeout = 300.0
    released_s: Released = 2.0
    clear_errors_per_h: PerHour = 0


class ChargerSettings(DeviceSettings, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What every charger has, whatever its driver.

    `limits`: durations and counts, where the defaults do not suit.
    """

    limits: Limits = Limits()
