"""A kind of device for the loader's tests only."""

from typing import Any

from bridges.kinds.shared.kind import AnyDeviceKind, Kind
from bridges.messages import topics


def _unused(*_: Any) -> Any:
    raise AssertionError("the loader decides nothing")


KIND: AnyDeviceKind = Kind(
    name="gate",
    devices_key="gates",
    states=topics.DOOR_STATES,
    device_name=_unused,
    limits=_unused,
    initial=_unused,
    decide=_unused,
    summary=_unused,
)
