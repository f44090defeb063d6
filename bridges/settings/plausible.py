"""What a type allows and nobody means: durations that are milliseconds, readings that come too late."""

from collections.abc import Iterable, Iterator
from typing import Final

from msgspec import inspect

from bridges.core.fields import DeviceSettings
from drivers.hal import Remark

RENEWED: Final = 3
"""Scans in which what switches off by itself must be renewed once."""
LONG_S: Final = 1000.0
"""What is this long is often meant in milliseconds."""


def milliseconds(structs: Iterable[tuple[tuple[str, ...], object]]) -> Iterator[Remark]:
    """Durations so long that they are looked at again, as (path, text), but for the defaults."""
    for path, struct in structs:
        info = inspect.type_info(type(struct))
        assert isinstance(info, inspect.StructType)
        for field in info.fields:
            value = getattr(struct, field.name)
            if field.name.endswith("_s") and isinstance(value, float) and value != field.default:
                yield from _long((*path, field.encode_name), value)


def _long(path: tuple[str, ...], value: float) -> Iterator[Remark]:
    if value >= LONG_S:
        text = f"{path[-1]} is {value:g} s, {_clock(value)}: if milliseconds are meant, write"
        yield path, f"{text} {value / 1000:g}"


def _clock(seconds: float) -> str:
    hours = seconds / 3600
    return f"{hours:.1f} hours" if hours >= 1 else f"{seconds / 60:.0f} minutes"


def out_of_step(device: DeviceSettings, bus: object) -> Iterator[Remark]:
    """What does not go with the pace of its bus: readings and commands that come too late."""
    scan_s = getattr(bus, "scan_s", 0.0)
    yield from _stale_readings(device, scan_s)
    if renewed := device.off_after():
        off_s, path = renewed
        lost_s = RENEWED * scan_s + getattr(bus, "timeout_s", 0.0)
        if off_s < lost_s:
            text = f"{path[-1]} is {off_s:g}, and it is renewed every {scan_s:g} s (scan_s)"
            yield path, f"{text}: at least {lost_s:g} s, so that one lost answer does not drop it"


def _stale_readings(device: DeviceSettings, scan_s: float) -> Iterator[Remark]:
    """That a reading is stale before the next one comes."""
    stale_s = device.stale_after()
    if stale_s is not None and scan_s >= stale_s:
        text = f"stale_after_s is {stale_s:g}, and its bus is read every {scan_s:g} s (scan_s)"
        yield ("limits", "stale_after_s"), f"{text}: it would never be in service; read more often"
