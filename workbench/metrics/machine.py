"""Metric families about the daemons on this machine. The values come from the daemons' status files."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from bridges.messages.words import printable
from bridges.runtime.daemons import DaemonStatus
from bridges.runtime.diagnostics import BUSES
from bridges.system.certificates import CertificateEnd

PREFIX: Final = "rmf_bridge_daemon_"
DAEMON: Final = ("daemon",)
DEVICE: Final = ("daemon", "device")
COUNTS: Final = {
    "scans": "Scans of the device.",
    "failed_scans": "Scans in which a reading or a command failed.",
    "scan_seconds": "Time spent in scans.",
}
CERTIFICATE: Final = ("daemon", "key", "file")
UNIT: Final = ("daemon", "bus", "unit")
CALLS: Final = {
    "calls": "Calls to a Modbus unit, a CANopen node, an HTTP controller or a broker.",
    "failed_calls": "Calls that got no reply, or that the unit refused.",
    "call_seconds": "Time spent in calls.",
}


def of_machine(found: Iterable[DaemonStatus]) -> Iterator[Metric]:
    """Yield the metric families about these daemons. Leave out stopped daemons.

    If a daemon no longer renews its status, yield only the age of the status. If this user may not read
    a daemon's files, yield only `unreadable`.
    """
    every = [one for one in found if one.state != "stopped"]
    yield from _daemons(every)
    serving = [one for one in every if one.state == "serving"]
    yield from _devices(serving)
    yield from _buses(serving)


def of_certificates(
    found: Iterable[DaemonStatus], others: Iterable[str], end: Callable[[str], CertificateEnd]
) -> Iterator[Metric]:
    """Yield when each certificate expires: the certificates that these daemons use, and the files
    `others`.

    For a file whose expiry cannot be read, `unreadable` is 1, and there is no expiry time.
    """
    ends = _certificate(
        "end_timestamp_seconds",
        "Time at which the certificate expires; for a file with several, the first such time.",
    )
    unreadable = _certificate("unreadable", "1 if the certificate's end cannot be read.")
    named = [used for one in found for used in one.certificates]
    for daemon, key, file in (*named, *(("", "--certificate", each) for each in others)):
        names, known = (daemon, printable(key), printable(file)), end(file)
        unreadable.add_metric(names, known.at is None)
        if known.at is not None:
            ends.add_metric(names, known.at)
    yield from (ends, unreadable)


def of_recordings(folder: Path) -> Iterator[Metric]:
    """Yield the size (bytes) of the recorder's folder, and the free space (bytes) of the folder's disk.

    If this user cannot read the folder, yield nothing, because the size is unknown.
    """
    try:
        with os.scandir(folder) as entries:
            size = sum(one.stat(follow_symlinks=False).st_size for one in entries)
        disk = os.statvfs(folder)
    except OSError:
        return
    free = float(disk.f_bavail * disk.f_frsize)
    yield GaugeMetricFamily("rmf_bridge_recordings_bytes", "Size of the recordings.", value=size)
    yield GaugeMetricFamily(
        "rmf_bridge_recordings_disk_free_bytes", "Free space on the recordings' disk.", value=free
    )


def _daemons(every: Iterable[DaemonStatus]) -> Iterator[Metric]:
    up = _gauge("up", "1 while the daemon serves and renews its status.", DAEMON)
    left_on = _gauge("outputs_unverified", "1 if a dead daemon's outputs may be on.", DAEMON)
    age = _gauge("status_age_seconds", "Age of the daemon's status.", DAEMON)
    unreadable = _gauge("unreadable", "1 if this user may not see the daemon.", DAEMON)
    slack = _gauge(
        "watchdog_slack_seconds",
        "Shortest time that was left before systemd's watchdog would act, since the report before.",
        DAEMON,
    )
    fault = _gauge("fault", "1 while the daemon itself has this fault.", (*DAEMON, "code"))
    for one in every:
        names = (printable(one.name),)
        unreadable.add_metric(names, one.state == "unknown")
        if one.state == "unknown":
            continue
        up.add_metric(names, one.state == "serving")
        left_on.add_metric(names, one.state == "left on")
        if one.age_s is not None:
            age.add_metric(names, one.age_s)
        if one.state != "serving":
            continue
        if (left := _number(one.status.get("watchdog_slack_s"))) is not None:
            slack.add_metric(names, left)
        for found in one.status.get("faults", ()):
            fault.add_metric((*names, printable(str(found.get("code", "")))), 1)
    yield from (up, left_on, age, unreadable, slack, fault)


def _devices(serving: Iterable[DaemonStatus]) -> Iterator[Metric]:
    counters = {key: _counter(f"device_{key}", text, DEVICE) for key, text in COUNTS.items()}
    longest = _gauge("device_longest_scan_seconds", "Longest scan in the last second.", DEVICE)
    switched = _counter(
        "output_switched_on", "Number of times that an output was switched on.", (*DEVICE, "output")
    )
    age = _gauge("device_input_age_seconds", "Age of the last reading.", DEVICE)
    for one, name, device in _each(serving):
        names = (printable(one.name), printable(name))
        counts = device.get("counts", {})
        for key, family in counters.items():
            if (value := _number(counts.get(key))) is not None:
                family.add_metric(names, value)
        if (value := _number(counts.get("longest_scan_s"))) is not None:
            longest.add_metric(names, value)
        for output, times in counts.get("switched_on", {}).items():
            switched.add_metric((*names, printable(output)), times)
        if (value := _number(device.get("input_age_s"))) is not None:
            age.add_metric(names, value)
    yield from (*counters.values(), longest, switched, age)


def _buses(serving: Iterable[DaemonStatus]) -> Iterator[Metric]:
    counters = {key: _counter(f"bus_{key}", text, UNIT) for key, text in CALLS.items()}
    longest = _gauge("bus_longest_call_seconds", "Longest call in the last second.", UNIT)
    families: list[tuple[str, CounterMetricFamily | GaugeMetricFamily]]
    families = [*counters.items(), ("longest_call_s", longest)]
    for one in serving:
        for bus, units in one.status.get(BUSES, {}).items():
            for unit, counts in units.items():
                names = (printable(one.name), printable(bus), printable(unit))
                for key, family in families:
                    if (value := _number(counts.get(key))) is not None:
                        family.add_metric(names, value)
    yield from (*counters.values(), longest)


def _each(
    serving: Iterable[DaemonStatus],
) -> Iterator[tuple[DaemonStatus, str, Mapping[str, Any]]]:
    for one in serving:
        for name, device in one.devices.items():
            yield one, name, device


def _number(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None


def _certificate(name: str, text: str) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"rmf_bridge_certificate_{name}", text, labels=CERTIFICATE)


def _gauge(name: str, text: str, labels: tuple[str, ...]) -> GaugeMetricFamily:
    return GaugeMetricFamily(PREFIX + name, text, labels=labels)


def _counter(name: str, text: str, labels: tuple[str, ...]) -> CounterMetricFamily:
    return CounterMetricFamily(PREFIX + name, text, labels=labels)
