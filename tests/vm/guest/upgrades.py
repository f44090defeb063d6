"""Upgrades to another version under difficulties: a YAML that the version refuses, a missing adapter, a
full disk, and a power cut."""

import os
import random
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.install import OURS, debs
from tests.vm.guest.rides import LIFT, end, energise, send
from tests.vm.guest.system import (
    Wrong,
    enable,
    far_side,
    is_active,
    pid,
    sh,
    since_boot_s,
    unit,
    until,
)
from tests.vm.guest.wires import tell

SERVICES = ("lift", "door", "charger", "lift_supervisor", "door_supervisor", "low")
OFF_S, READY_S = 12.0, 20.0
"""Limits (s) for the boot after a power cut. Both count from the start of the kernel. All outputs must
be off within OFF_S, and all services ready within READY_S. docs/explanation/reliability.md has these
limits."""
YAML = Path("/etc/rmf-bridges/lift.yaml")
CURRENT = Path("/usr/lib/rmf-bridges/current")
NOT_OURS = ("/var/cache/", "/run/systemd/", "/var/tmp/systemd-private-")
"""Folders with files that our package does not own: files of apt, and files that systemd keeps for a
unit until the next boot."""
UPGRADE_S = 45.0
"""The power cut comes within this time (s) after the start of an upgrade. A whole upgrade takes less
time, so some cuts come after its end."""
FORCE = ("dpkg", "--force-confold", "--install")
BEFORE, NEXT = ".", "next"
"""The folders of the two versions, below the folder of packages."""
TARGET = Path("/var/lib/checks-target")
"""A file that lists the packages whose installation the power cut interrupted."""


def site() -> str:
    """Let a lift, two doors, a charger and both supervisors serve. Switch relays of the lift and of one
    door on."""
    enable("low")
    wait = [since_boot_s(unit(name), "ActiveEnterTimestampMonotonic") for name in SERVICES]
    send("door", "ward_door", "open", "--direct")
    energise()
    Path("/var/lib/checks-version").write_text(version())
    sh("sync")
    return f"{len(wait)} services, status says {_status()}"


def booted() -> str:
    """Check that the whole site returns after a power cut. After the kernel's start, outputs must be
    off within 12 s, and all services ready within 20 s."""
    until(lambda: all(map(is_active, map(unit, SERVICES))), "every service is ready")
    first, on = _first_writes()
    ready = {n: since_boot_s(unit(n), "ActiveEnterTimestampMonotonic") for n in SERVICES}
    _wires_back()
    sh("systemd-analyze", "critical-chain", unit("lift"), "--no-pager")
    sh("systemd-analyze", "blame", "--no-pager")
    sh("journalctl", "-b", "-u", "rmf-bridge-outputs-off.service", "-o", "short-monotonic")
    text = ", ".join(f"{name} {s:.1f}" for name, s in ready.items())
    if on or first > OFF_S or max(ready.values()) > READY_S:
        raise Wrong(f"on {on}, all off {first:.1f} s after the kernel's start, ready: {text}")
    return f"all written off {first:.1f} s after the kernel's start, ready: {text}"


def _first_writes() -> tuple[float, list[header.Write]]:
    """Return the time of the first write to the lift's last output. Return also the writes that
    switched an output on."""
    writes = [each for each in header.writes() if each.line in LIFT]
    if {each.line for each in writes} != LIFT.keys():
        raise Wrong(f"not every output of the lift was written; writes: {writes}")
    first = {line: min(w.at for w in writes if w.line == line) for line in LIFT}
    return max(first.values()), [each for each in writes if each.level == LIFT[each.line]]


def _wires_back() -> None:
    """Start the simulated equipment again, because the reboot has ended its process."""
    if not Path("/sys/class/net/vcan0").exists():
        sh("ip", "link", "add", "vcan0", "type", "vcan")
        sh("ip", "link", "set", "vcan0", "up")
    for name in ("lift", "door", "charger"):
        if not Path(f"/run/far-{name}").exists():
            far_side(name)


def version() -> str:
    """Return the package's version, as dpkg reports it."""
    return sh("dpkg-query", "-W", "-f", "${Version}", "rmf-bridges")


def _states() -> str:
    """Return each package's state and version, as dpkg reports them."""
    return sh("dpkg-query", "-W", "-f", "${db:Status-Status} ${Version}, ", *OURS).rstrip(", ")


def _is_whole() -> bool:
    """Return whether dpkg has all packages installed, all in the same version."""
    states = set(_states().split(", "))
    return len(states) == 1 and states.pop().startswith("installed ")


def _force(folder: str, fails: bool = False) -> str:
    """Install the packages of this folder with dpkg alone, as a person does after a power cut. Return
    dpkg's output."""
    return sh(*FORCE, *map(str, debs(folder)), fails=fails)


def _held() -> dict[int, bool]:
    """Hold two relays on. The supervisor is stopped, because it would end a session that it does not
    know."""
    sh("systemctl", "stop", unit("lift_supervisor"))
    return energise()


def _status() -> str:
    """Return the exit code of `rmf-bridge status`: 0 if all is well, 1 for faults, 2 for a dead
    daemon."""
    import subprocess

    done = subprocess.run(["rmf-bridge", "status"], capture_output=True, text=True)
    print(done.stdout, done.stderr)
    if done.returncode not in (0, 1, 2) or "Traceback" in done.stderr:
        raise Wrong(f"status: {done.returncode}: {done.stderr[-300:]}")
    return str(done.returncode)


def refused() -> str:
    """Check that an upgrade that refuses a YAML names the file and the line, and changes nothing."""
    old, tree, text = pid(unit("lift")), CURRENT.readlink(), YAML.read_text()
    YAML.write_text(text + "flors: [L1]\n")
    try:
        told = _force(NEXT, fails=True)
    finally:
        YAML.write_text(text)
    state = sh("dpkg-query", "-W", "-f", "${db:Status-Status}", "rmf-bridges")
    if f"{YAML}:" not in told or (state, CURRENT.readlink(), pid(unit("lift"))) != (
        "half-configured",
        tree,
        old,
    ):
        raise Wrong(f"{state}, {CURRENT.readlink()}, {told[-300:]}")
    return f"the package is half-configured, the services are as before, status {_status()}"


def absent() -> str:
    """Check that `dpkg --configure -a` starts every service after the YAML has been corrected.
    Meanwhile the door's adapter is missing."""
    tell("door", "fail ward_door server off")
    began = time.monotonic()
    told = sh("dpkg", "--configure", "-a")
    took = time.monotonic() - began
    states = {name: is_active(unit(name)) for name in SERVICES}
    tell("door", "fail ward_door server ok")
    send("door", "ward_door", "open", "--direct")
    trees = os.listdir("/usr/lib/rmf-bridges/trees")
    if not all(states.values()) or not version().endswith(".1") or len(trees) != 1:
        raise Wrong(f"{version()}: {states}, {trees}, {told[-300:]}")
    said = next((line for line in told.splitlines() if "not verified off" in line), "said nothing")
    return f"{took:.1f} s, {version()}: all serve, the door again when its adapter is back; {said}"


def back() -> str:
    """Install the earlier version while two relays are on. Check that the relays go off and that every
    service returns."""
    relays, when = _held(), header.now()
    _force(BEFORE)
    sh("systemctl", "start", unit("lift_supervisor"))
    off = header.off_at(relays, when)
    if off.keys() != relays.keys() or not all(map(is_active, map(unit, SERVICES))):
        raise Wrong(f"version {version()}, relays written off: {off}")
    return f"{version()}: off after {max(off.values()) - when:.1f} s, all serve, status {_status()}"


@contextmanager
def _full() -> Iterator[None]:
    """Fill the disk for everybody, even for root, until the end of the block."""
    filler = Path("/var/filler")
    try:
        with filler.open("wb") as out:
            for size in (1 << 26, 1 << 20, 1 << 12):
                with suppress(OSError):
                    while True:
                        os.posix_fallocate(out.fileno(), os.fstat(out.fileno()).st_size, size)
        yield
    finally:
        filler.unlink()


def full_var() -> str:
    """Check that all services keep running through `enable`, a ride and an upgrade while /var and its
    disk are full."""
    with _full():
        sh(
            "sh", "-c", f"rmf-bridge enable {YAML} || true"
        )  # `enable` may still succeed, because it can reuse the space of its old record
        until(lambda: is_active(unit("lift")), "the lift's service is back")
        energise()
        _status()
        end()
        old = pid(unit("lift"))
        told = _force(NEXT, fails=True)
        if pid(unit("lift")) != old or not all(map(is_active, map(unit, SERVICES))):
            raise Wrong(f"a service did not keep running: {told[-300:]}")
    was = version()
    _force(BEFORE)
    return f"upgrade fails ({was}), all serve during enable and a ride; with space dpkg succeeds"


def cut() -> str:
    """Let the power fail at a random moment of an upgrade or a downgrade."""
    folder = (NEXT, BEFORE)[version().endswith(".1")]
    TARGET.write_text(folder)
    _held()
    sh("sync")
    moment = random.SystemRandom().uniform(0, UPGRADE_S)
    Path("/var/lib/checks-moment").write_text(f"{moment:.1f}")
    os.sync()
    words = f"sleep {moment}; echo b > /proc/sysrq-trigger"
    sh("systemd-run", "sh", "-c", words)
    sh("systemd-run", *FORCE, *map(str, debs(folder)))
    return "soon"


def completed() -> str:
    """Check the machine after the power cut of `cut`. At boot all outputs must be off, and all services
    must run the same version. Then complete the interrupted installation. All services must run the
    version that it installs."""
    moment = Path("/var/lib/checks-moment").read_text()
    until(lambda: all(map(is_active, map(unit, SERVICES))), "every service is ready")
    first, on = _first_writes()
    if on:
        raise Wrong(f"cut after {moment} s: on at boot {on}")
    sh("rmf-bridge", "outputs-off", "--help")
    state = _states()
    tree = CURRENT.readlink().name
    status = _status()
    if "half-installed" not in state:
        sh("dpkg", "--configure", "-a")
    if not _is_whole():
        _force(TARGET.read_text())  # the folder of packages is not mounted after a boot
    _wires_back()
    until(lambda: all(map(is_active, map(unit, SERVICES))), "every service is back")
    trees = os.listdir(CURRENT.parent / "trees")
    if not _is_whole() or len(trees) != 1:
        raise Wrong(f"cut after {moment} s: {state}, then {_states()}, {trees}")
    served = f"by {tree}, off {first:.1f} s, status {status}"
    return f"cut after {moment} s: {state}, {served}; completed: {version()}"


def purged() -> str:
    """Check that `apt purge` leaves only the user and the groups of the package."""
    sh("env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "purge", "--yes", *OURS)
    left = sh("find", "/etc", "/usr", "/var", "/run", "-xdev", "-name", "*rmf-bridge*").split()
    left = [name for name in left if not name.startswith(NOT_OURS)]
    if left:
        raise Wrong(f"left after the purge: {left}")
    return "nothing"
