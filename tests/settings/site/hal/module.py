"""Contacts with names in words, without a spelling of their own in a table."""

from typing import Annotated

import msgspec
from msgspec import Meta

from drivers.hal import Bus, BusType


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The module."""

    host: str
    port: Annotated[int, Meta(ge=1, le=65535)] = 502


def canonical(point: str) -> str:
    """One spelling."""
    if not point.startswith("coil "):
        raise ValueError(f"{point!r}: write coil and its number")
    return point


def open_bus(settings: Settings) -> Bus:
    """No test opens it."""
    raise NotImplementedError


BUS = BusType(settings=Settings, open_bus=open_bus, canonical=canonical)
