"""What happens around a service: its file, its disks."""

import os
import re
import time
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.deaths import off_after
from tests.vm.guest.rides import energise
from tests.vm.guest.system import Wrong, back, is_active, kill, pid, sh, unit

SERVICE = unit("lift")
YAML = Path("/etc/rmf-bridges/lift.yaml")
MOVED = {"BCM18": "BCM25", "BCM16": "BCM26"}
"""Pins of the outputs that a session holds, and others that are free."""


def edited_yaml() -> str:
    """The YAML gets other pins while two relays are on, then kill -9: the old pins are off."""
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
        raise Wrong(f"of the new pins {new} are written")
    return f"old pins off after {took:.2f} s, back with the new ones"


def full_run() -> str:
    """/run is full, two relays on, kill -9: off; back as soon as there is room, or before."""
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
