"""A bus without points."""

import msgspec


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The server."""

    host: str


def open_bus(settings: Settings) -> None:
    """Never."""
