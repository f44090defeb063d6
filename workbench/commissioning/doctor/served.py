"""Find a running daemon of this file, and read the daemon's status. If a daemon runs, the doctor does
not open the daemon's buses.

The doctor leaves the buses closed for two reasons. A gateway may accept only one client. Two masters on
one line corrupt each other's frames.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from bridges.runtime import holder
from bridges.runtime.daemons import DaemonStatus, daemons
from bridges.runtime.faults import remedies
from bridges.runtime.record import Records
from bridges.runtime.subject import Status
from bridges.system.directories import Directories
from workbench.commissioning.doctor.finding import Finding, note, ok, warning, wrong

DAEMON: Final = "daemon"
NOT_ASKED: Final = "doctor does not read the buses, because only one process may use a bus"


@dataclass(frozen=True, slots=True)
class ServingDaemon:
    """State of the file's daemon.

    - `busy`: the reason why the doctor must not open the daemon's buses; "" if the doctor may.
    - `serving`: whether a daemon serves this file; None if unknown.
    - `simulated`: whether the daemon runs on fake hardware and on the loopback interface.
    """

    findings: list[Finding] = field(default_factory=list)
    busy: str = ""
    serving: bool | None = False
    simulated: bool = False


def served(places: Directories, file: Path, wall: float) -> ServingDaemon:
    """Examine the file's daemon. `wall` is the present time (s since the epoch), which gives the age of
    the daemon's status."""
    try:
        held_by = holder.look(places)
    except PermissionError as error:
        return unseen(str(error))
    if held_by is None:
        return _nobody(places, file)
    if not held_by.serves:
        found = f"{held_by} uses the file's devices; it is walk, outputs-off or another doctor"
        return ServingDaemon(
            [warning(DAEMON, found, NOT_ASKED, "wait until that process has ended")], found
        )
    one = next(daemons([places.runtime], {}, wall))
    busy, simulated = f"process {held_by.pid} serves this file", bool(one.status.get("simulated"))
    return ServingDaemon(list(_told(one)), busy, True, simulated)


def unseen(why: str) -> ServingDaemon:
    """Warn that this user cannot see whether a daemon runs."""
    return ServingDaemon(
        [wrong(DAEMON, why, NOT_ASKED, "write sudo before the command")], why, None
    )


def _nobody(places: Directories, file: Path) -> ServingDaemon:
    if Records(places).unreleased():
        found = "the daemon has died, and may have left outputs on"
        do, means = f"rmf-bridge outputs-off {file}", "a relay may hold a door or a call"
        return ServingDaemon([wrong(DAEMON, f"{found}; {NOT_ASKED}", means, do)], found)
    return ServingDaemon([ok(DAEMON, "no daemon serves this file, so its buses are read here")])


def _told(one: DaemonStatus) -> Iterator[Finding]:
    if one.state != "serving":
        do = "rmf-bridge log FILE; then restart it"
        age = "never" if one.age_s is None else f"{one.age_s:.0f} s ago"
        yield wrong(
            DAEMON, f"the daemon runs, but wrote its status {age}", "the daemon may hang", do
        )
    else:
        version = one.status.get("version", "?")
        yield ok(DAEMON, f"the daemon serves this file, version {version}; {NOT_ASKED}")
    if one.status.get("simulated"):
        means = "no hardware moves; findings below about pins and ports are for a real device"
        yield note(
            DAEMON, "the daemon is a SIMULATION", means, "run it without --simulate on the Pi"
        )
    else:
        yield from _listeners(one.status)
    yield from _faults("", one.status)
    for name, device in one.devices.items():
        age_s = device.get("input_age_s")
        if age_s is None:
            yield wrong(
                DAEMON,
                f"{name} was never read",
                "RMF gets no state of this device",
                "see the faults of this device",
            )
        else:
            yield ok(DAEMON, f"{name} was read {age_s:.1f} s before the daemon wrote its status")
        yield from _faults(f"{name}: ", device)


def _listeners(status: Status) -> Iterator[Finding]:
    """Check that at least one node listens to the daemon's states. Other topics often have no
    listener."""
    for topic, nodes in status.get("heard_by", {}).items():
        if nodes:
            yield ok(DAEMON, f"{topic}: heard by {nodes} node{'s' if nodes > 1 else ''}")
        elif topic.endswith("_states"):
            do = "docs/how-to/ros.md: domain, multicast, interfaces"
            yield warning(DAEMON, f"{topic}: nobody listens", "RMF does not see the device", do)


def _faults(of: str, part: Status) -> Iterator[Finding]:
    known = remedies() if part.get("faults") else {}
    for fault in part.get("faults", ()):
        found = of + ": ".join(filter(None, (fault["code"], fault["detail"])))
        remedy = known.get(fault["code"])
        yield wrong(DAEMON, found, remedy.cause if remedy else "", remedy.do if remedy else "")
