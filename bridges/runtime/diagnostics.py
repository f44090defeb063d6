"""A daemon's diagnostics for ROS's `/diagnostics`, made from its status file.

The message has one status for the daemon and one for each device. For a supervisor, the devices are its
lifts or doors.

- `name` is `<node>: <device>`, as ROS's aggregator expects.
- `hardware_id` is the device's name.
- `message` has the codes of the faults.
- `values` come from the status file. For a fault, the key is the fault's code and the value is its
  detail.

LiftState, DoorState and ChargerState have no fields for faults, so diagnostics carry the faults.

    OK      the input is read, and there is no fault
    WARN    the daemon is a simulation, or has just started and only listens for other nodes
    ERROR   the device or the daemon has faults; the daemon has a fault if it cannot publish, or if
            another node publishes in its place
    STALE   the device's input has not been read yet
"""

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Final

from bridges.messages.definitions import (
    DiagnosticArray,
    DiagnosticLevel,
    DiagnosticStatus,
    Header,
    KeyValue,
    Time,
)
from bridges.observe.diagnosis import PASSIVE, SIMULATED
from bridges.runtime.scan_counts import COUNTS
from bridges.runtime.subject import Status
from bridges.system.log import plain

MOST: Final = 100
"""The maximum number of devices in a message. The limit is needed because anybody on the network can
send a supervisor many names."""
CONTACTS: Final = "contacts"
CERTIFICATE_FILES: Final = "certificate_files"
BUSES: Final = "buses"
NOT_SENT: Final = (CONTACTS, COUNTS, CERTIFICATE_FILES, BUSES)
"""Keys that stay in the status file and are not sent. Contacts and counts would be most of the traffic
on the ROS graph. The paths of files are useful only on this machine."""


def diagnosis(
    node: str, kind: str, daemon: Status, devices: Mapping[str, Status], at: Time
) -> DiagnosticArray:
    """Return the message. `daemon` and `devices`: the parts of the status file. `at`: the present
    time."""
    statuses = [_daemon(node, kind, daemon)]
    statuses += [_device(node, kind, *named) for named in islice(devices.items(), MOST)]
    return DiagnosticArray(Header(at), tuple(statuses))


def _daemon(node: str, kind: str, status: Status) -> DiagnosticStatus:
    odd = [
        word for key, word in (("simulated", SIMULATED), ("passive", PASSIVE)) if status.get(key)
    ]
    level = DiagnosticLevel.WARN if odd else DiagnosticLevel.OK
    if found := status.get("faults"):
        level, odd = DiagnosticLevel.ERROR, [fault["code"] for fault in found]
    values = _values({"kind": kind, **status})
    return DiagnosticStatus(level, f"{node}: daemon", ", ".join(odd) or "OK", node, values)


def _device(node: str, kind: str, name: str, status: Status) -> DiagnosticStatus:
    found = status.get("faults", ())
    level, message = DiagnosticLevel.OK, "OK"
    if found:
        level, message = DiagnosticLevel.ERROR, ", ".join(fault["code"] for fault in found)
    elif status.get("input_age_s") is None:
        level, message = DiagnosticLevel.STALE, "not read yet"
    return DiagnosticStatus(
        level, f"{node}: {name}", message, name, _values({"kind": kind, **status})
    )


def _values(status: Status) -> tuple[KeyValue, ...]:
    return tuple(KeyValue(key, value) for key, value in _pairs(status))


def _pairs(status: Status) -> Iterator[tuple[str, str]]:
    """Yield the status as pairs of key and value. For a fault, the pair is its code and its detail. A
    table becomes one pair for each of its entries."""
    for key, value in status.items():
        if key in NOT_SENT:
            continue
        if key == "faults":
            yield from ((fault["code"], fault["detail"]) for fault in value)
        elif isinstance(value, Mapping):
            yield from ((f"{key} {part}", plain(count)) for part, count in value.items())
        else:
            yield key, plain(value)
