"""The time zone of a browser."""

from datetime import UTC, tzinfo
from typing import Final
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

LONGEST: Final = 64


def zone_of(name: object) -> tzinfo | None:
    """Return the time zone of this name. For an unknown name, return None, which means this machine's
    zone."""
    if not isinstance(name, str) or len(name) > LONGEST:
        return None
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):  # the name comes from a browser
        return UTC if name == "UTC" else None
