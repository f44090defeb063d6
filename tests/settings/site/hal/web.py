"""A bus without points."""

import msgspec

from drivers.hal import Bus, BusType


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of the server."""

    host: str


def open_bus(settings: Settings) -> Bus:
    """Open nothing: no test opens this bus."""
    raise NotImplementedError


BUS = BusType(
    settings=Settings,
    open_bus=open_bus,
)
