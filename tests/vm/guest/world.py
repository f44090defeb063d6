"""Changes around a service: its YAML file, its disks, its clock, and the model of the Pi."""

import os
import re
import time
from collections.abc import Iterable
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.deaths import off_after
from tests.vm.guest.rides import HELD, LIFT, end, energise, send
from tests.vm.guest.system import Wrong, back, far_side, is_active, kill, pid, sh, unit, until

SERVICE = unit("lift")
YAML = Path("/etc/rmf-bridges/lift.yaml")
MOVED = {"BCM18": "BCM25", "BCM16": "BCM26"}
"""The pins of the outputs that a session holds on, each with a free pin to replace it."""
EVENT = re.compile(r"[a-z_]+( [a-z_]+=\S|$)")
SYSRQ = Path("/proc/sysrq-trigger")
STEPS = (10, -20, 10)
"""The steps of the clock (years): ten years ahead, then ten years behind, then right again."""
MEANWHILE_S = 12.0
"""A pause (s) longer than the leases of the watchdog and of a node. If the service slept by the wall
clock, a lease would run out during this pause."""
HEARD_S = 20.0
"""The time (s) within which a request must take effect after a step of the clock. Of this time the
lift's ride takes 5 s."""


def edited_yaml() -> str:
    """Replace pins in the YAML file while two relays are on, and kill the service with -9. Check that
    the relays on the old pins go off."""
    relays, old, text = energise(), pid(SERVICE), YAML.read_text()
    YAML.write_text(re.sub("|".join(MOVED), lambda found: MOVED[found[0]], text))
    when = header.now()
    try:
        kill(SERVICE, "KILL")
        took = off_after(relays, when)
        back(SERVICE, old)
        new = {each.line for each in header.writes(when)} & {25, 26}
    finally:
        YAML.write_text(text)
        sh("systemctl", "restart", SERVICE)
    if new != {25, 26}:
        raise Wrong(f"of the new pins the service has written only {sorted(new)}")
    return f"old pins off after {took:.2f} s, back with the new ones"


def full_run() -> str:
    """Fill /run while two relays are on, and kill the service with -9. Check that the relays go off and
    that the service returns."""
    relays, old = energise(), pid(SERVICE)
    filler = Path("/run/filler")
    with filler.open("wb") as out:
        room = os.statvfs("/run")
        os.posix_fallocate(out.fileno(), 0, room.f_bavail * room.f_frsize)
    when = header.now()
    try:
        kill(SERVICE, "KILL")
        took = off_after(relays, when)
        time.sleep(10)
        text = "back" if is_active(SERVICE) else "not back until there is room"
    finally:
        filler.unlink()
    back(SERVICE, old)
    return f"off after {took:.2f} s, {text}"


def clock() -> str:
    """Set the clock ten years ahead, then behind, then right again. Check that two relays stay on and
    that the service fulfils requests."""
    relays, old, waits = energise(), pid(SERVICE), []
    for years, floor in zip(STEPS, ("L3", "L1", "L3"), strict=True):
        when = header.now()
        sh("date", "-s", f"{years:+d} years")
        time.sleep(MEANWHILE_S)
        if header.off_at(relays, when) or pid(SERVICE) != old:
            raise Wrong(
                f"{years:+d} years: went off: {header.off_at(relays, when)}, pid {pid(SERVICE)}"
            )
        waits.append(_goes_to(floor))
    end()
    return f"no restart; requests took effect after {', '.join(f'{s:.1f}' for s in waits)} s"


def _goes_to(floor: str) -> float:
    """Return the time (s) until a request of a new node takes effect. Meanwhile the two relays of the
    session must stay on."""
    began = header.now()
    send("lift", "Lift1", floor, "--session", "vm/robot", "--direct")
    took = header.now() - began
    if sorted(header.on(LIFT)) != HELD or took > HEARD_S:
        raise Wrong(f"at {floor} after {took:.1f} s; lines on: {sorted(header.on(LIFT))}")
    return took


def read_only_root() -> str:
    """Make the root file system read only. Check that the service starts and serves, and that the
    relays go off after kill -9."""
    sh("systemctl", "stop", SERVICE)
    sh("journalctl", "--relinquish-var")
    SYSRQ.write_text("u")  # this makes the root read only, as the kernel does for a damaged disk
    until(lambda: "ro" in _options("/"), "the root is read only")
    try:
        sh("systemctl", "start", SERVICE)
        relays, when, old = energise(), header.now(), pid(SERVICE)
        kill(SERVICE, "KILL")
        took = off_after(relays, when)
        back(SERVICE, old)
        if "ro" not in _options("/"):
            raise Wrong("the root was writable again")
    finally:
        sh("mount", "-o", "remount,rw", "/")
        sh("journalctl", "--flush")
    return f"two relays on; killed, off after {took:.2f} s, and back"


def _options(mount: str) -> set[str]:
    lines = (line.split() for line in Path("/proc/self/mounts").read_text().splitlines())
    return next(set(words[3].split(",")) for words in lines if words[1] == mount)


def labels() -> str:
    """Check that the service finds the header's chip by its label on Raspberry Pi 3, 5 and 4."""
    sh("systemctl", "stop", SERVICE, "far-lift.service")
    for label in header.LABELS:  # the last label stays for the other checks
        header.unplug()
        header.plug(label)
        sh("udevadm", "settle")
        _claims(label, LIFT)
    far_side("lift")
    sh("systemctl", "start", SERVICE)
    return ", ".join(header.LABELS)


def _claims(label: str, lines: Iterable[int]) -> None:
    """Start the service, wait until it has written each output, and stop it."""
    when = header.now()
    sh("systemctl", "start", SERVICE)
    written = {each.line for each in header.writes(when)}
    sh("systemctl", "stop", SERVICE)
    if not written.issuperset(lines):
        raise Wrong(f"on {label} the service has written {sorted(written)}")


def said() -> str:
    """Check the form of the journal. Each line must be an event with key=value pairs, and no line may
    belong to a traceback."""
    text = sh("journalctl", "-b", "-u", SERVICE, "-o", "cat", "-t", "rmf-bridge")
    lines = text.splitlines()
    if not lines:
        raise Wrong("the journal has no line of the service")
    if others := [line for line in lines if not EVENT.match(line)]:
        raise Wrong(
            f"{len(others)} of {len(lines)} log lines have another form, first: {others[0]}"
        )
    return f"{len(lines)} lines, the longest has {max(map(len, lines))} characters"
