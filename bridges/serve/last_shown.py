"""The last status of a daemon that has died: `status.json`, if it is still there."""

import os
from collections.abc import Mapping

import msgspec

from bridges.serve.directory import STATUS
from bridges.serve.places import Places

SIZE_MAX = 4 << 20


class _Device(msgspec.Struct):
    input_age_s: float | None = None


class _StatusFile(msgspec.Struct):
    devices: dict[str, _Device] = {}


def ages(places: Places) -> Mapping[str, float]:
    """How long ago (s) each device had answered then; those that never had are left out."""
    path = places.runtime / STATUS
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK), "rb") as source:
            shown = msgspec.json.decode(source.read(SIZE_MAX), type=_StatusFile)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return {}
    found = {name: device.input_age_s for name, device in shown.devices.items()}
    return {name: age for name, age in found.items() if age is not None}
