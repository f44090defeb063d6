"""A bus without points."""

import msgspec

from drivers.hal import Bus, BusType


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The server."""

    host: str


def open_bus(settings: Settings) -> Bus:
    """No test opens it."""
    raise NotImplementedError


BUS = BusType(
    settings=Settings,
    open_bus=open_bus,
)
