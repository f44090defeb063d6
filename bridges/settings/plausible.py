"""Finds implausible settings, such as durations in milliseconds and readings that are always stale."""

from collections.abc import Iterable, Mapping
from typing import Final

from msgspec.inspect import StructType

from bridges.kinds.shared.fields import DeviceSettings
from bridges.kinds.shared.remarks import Remarks
from bridges.yaml.values import described

RENEWED: Final = 3
"""The least number of scans that the watchdog timer of an output must outlast. Each scan restarts this
timer."""
LONG_S: Final = 1000.0
"""The duration (s) from which a duration is suspicious. Often the user has written milliseconds."""


def milliseconds(structs: Iterable[tuple[tuple[str, ...], object]]) -> Remarks:
    """Yield a remark (path, text) for each suspiciously long duration. Defaults are left out."""
    for path, struct in structs:
        cls: object = type(struct)
        info = described(cls)
        assert isinstance(info, StructType)
        for field in info.fields:
            value = getattr(struct, field.name)
            if field.name.endswith("_s") and isinstance(value, float) and value != field.default:
                yield from _long((*path, field.encode_name), value)


def _long(path: tuple[str, ...], value: float) -> Remarks:
    if value >= LONG_S:
        text = f"{path[-1]} is {value:g} s, {_clock(value)}: if milliseconds are meant, write"
        yield path, f"{text} {value / 1000:g}"


def _clock(seconds: float) -> str:
    hours = seconds / 3600
    return f"{hours:.1f} hours" if hours >= 1 else f"{seconds / 60:.0f} minutes"


def out_of_step(device: DeviceSettings, bus: object, others: Iterable[object] = ()) -> Remarks:
    """Yield a problem for readings or commands that come too late, because the device's bus is too
    slow.

    `others`: the settings of the device's other buses. Invalid settings of a bus count as fast.
    """
    scan_s = getattr(bus, "scan_s", 0.0)
    slowest_s = max(scan_s, *(getattr(other, "scan_s", 0.0) for other in others), 0.0)
    yield from _stale_readings(device, slowest_s)
    if renewed := device.off_after():
        off_s, path = renewed
        lost_s = RENEWED * scan_s + getattr(bus, "timeout_s", 0.0)
        if off_s < lost_s:
            text = f"{path[-1]} is {off_s:g}, but it is renewed every {scan_s:g} s (scan_s)"
            yield (
                path,
                f"{text}: write at least {lost_s:g}, so that one lost reply does not switch off the"
                " output",
            )


def long_calls(bus: object, devices: Iterable[DeviceSettings]) -> Remarks:
    """Yield a remark if a call to a silent device takes longer than a reading stays fresh. The daemon
    publishes nothing during a call."""
    limits = [stale_s for each in devices if (stale_s := each.stale_after()) is not None]
    attempts = 1 + getattr(bus, "retries", 0)
    call_s = attempts * getattr(bus, "timeout_s", 0.0)
    if limits and call_s > min(limits):
        times = f" x {attempts} attempts" if attempts > 1 else ""
        text = f"a call to a silent device takes {call_s:g} s (timeout_s{times})"
        yield (
            ("timeout_s",),
            f"{text}, but stale_after_s is {min(limits):g}: RMF hears only later that the device is"
            " silent; lower timeout_s, or raise stale_after_s",
        )


def late_inputs(device: DeviceSettings, debounce: Mapping[str, float]) -> Remarks:
    """Yield a problem for each limit that is over before the input that it waits for can count.
    `debounce` maps a signal to its debounce (s)."""
    for signal, key, other in device.awaited():
        limit_s: float = getattr(device.limits, key)  # type: ignore[attr-defined]
        if signal in debounce and (not other or other in debounce):
            late_s = debounce[signal] - debounce.get(other, 0.0)
            if late_s >= limit_s:
                text = f"{key} is {limit_s:g}, but {signal} counts {late_s:g} s late (debounce)"
                yield ("limits", key), f"{text}: write a longer {key}, or a shorter debounce_s"


def _stale_readings(device: DeviceSettings, scan_s: float) -> Remarks:
    """Yield a problem if a reading becomes stale before the next reading."""
    stale_s = device.stale_after()
    if stale_s is not None and scan_s >= stale_s:
        text = f"stale_after_s is {stale_s:g}, but its bus is read every {scan_s:g} s (scan_s)"
        fix = f"raise stale_after_s above {scan_s:g}, or lower scan_s"
        yield ("limits", "stale_after_s"), f"{text}: readings would always be stale; {fix}"
