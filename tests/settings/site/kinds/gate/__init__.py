"""A kind of device that only the loader's tests know."""

from typing import Any, cast

from bridges.kinds.shared.kind import AnyDeviceKind, Kind


def _unused(*_: Any) -> Any:
    raise AssertionError("the loader decides nothing")


KIND: AnyDeviceKind = Kind(
    name="gate",
    devices_key="gates",
    states=cast(Any, None),
    requests={},
    device_name=_unused,
    sender=lambda message: "",
    limits=_unused,
    initial=_unused,
    decide=_unused,
    state_message=_unused,
    summary=_unused,
)
