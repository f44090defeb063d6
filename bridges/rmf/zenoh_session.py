"""Opening and closing a zenoh session."""

import ctypes
import json
from contextlib import suppress
from typing import Any

import zenoh


def opened(ways: list[dict[str, Any]]) -> zenoh.Session:
    """A session by the first of these configurations that serves. Raises ZError when none does."""
    wanted, *further = ways
    config = zenoh.Config()
    for key, value in wanted.items():
        config.insert_json5(key, json.dumps(value))
    try:
        return zenoh.open(config)
    except zenoh.ZError:
        if further:
            return opened(further)
        raise


def closed(session: zenoh.Session, held: list[Any]) -> None:
    with suppress(zenoh.ZError):  # by a dead link nobody hears the farewell
        session.close()  # type: ignore[no-untyped-call]
    held.clear()


def give_back() -> None:
    """Return freed memory to the machine: opening a session leaves 2.5 MB of it in this process."""
    with suppress(AttributeError):  # a C library other than glibc has no such call
        ctypes.CDLL(None).malloc_trim(0)
