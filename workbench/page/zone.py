"""The time zone of a browser."""

from datetime import UTC, tzinfo
from typing import Final
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

LONGEST: Final = 64


def zone_of(name: object) -> tzinfo | None:
    """Return the time zone of this name. None, which means this machine's zone, stands for an unknown
    name."""
    if not isinstance(name, str) or len(name) > LONGEST:
        return None
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):  # a name may come from anybody
        return UTC if name == "UTC" else None
