"""The last status of a daemon that has died: `status.json`, if it is still there."""

from collections.abc import Mapping

import msgspec

from bridges.host.files import read
from bridges.host.places import Places
from bridges.runtime.holder import STATUS, STATUS_MAX


class _Device(msgspec.Struct):
    input_age_s: float | None = None


class _StatusFile(msgspec.Struct):
    devices: dict[str, _Device] = {}


def ages(places: Places) -> Mapping[str, float]:
    """How long ago (s) each device had answered then; those that never had are left out."""
    try:
        shown = msgspec.json.decode(read(places.runtime / STATUS, STATUS_MAX), type=_StatusFile)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return {}
    found = {name: device.input_age_s for name, device in shown.devices.items()}
    return {name: age for name, age in found.items() if age is not None}
