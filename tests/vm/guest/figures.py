"""Start times, memory and times until relays are off, divided by those of an empty Python service. The
ratios do not depend on the machine's speed."""

import re
import time
from pathlib import Path

from tests.vm.guest.system import KEPT, Wrong, kill, pid, ready_s, sh, unit, until

SERVICES = ("lift", "door", "charger", "lift_supervisor", "door_supervisor")
WHOLE_MB = 200.0
MOST = (25, 10, 10)
"""The highest permitted ratios to the empty service, for three values. The values are the time until
ready, the memory, and the time from kill -9 until the relays are off."""
EMPTY = """
[Service]
Type=notify
ExecStart=/usr/bin/python3 /mnt/tests/vm/guest/empty.py
ExecStopPost=/usr/bin/python3 /mnt/tests/vm/guest/empty.py off
"""


def memory() -> str:
    """Check that the lift, a door, a charger and both supervisors together use less than 200 MB."""
    each = {name: pss_mb(unit(name)) for name in SERVICES}
    whole = sum(each.values())
    text = ", ".join(f"{name} {mb:.0f}" for name, mb in each.items())
    if whole > WHOLE_MB:
        raise Wrong(f"{whole:.0f} MB: {text}")
    return f"{whole:.0f} MB (PSS): {text}"


def ratios() -> str:
    """Check that lift, door and charger need at most a fixed multiple of what an empty Python service
    needs. The values are the start time, the memory, and the time from kill -9 until the relays are
    off."""
    Path("/run/systemd/system/empty.service").write_text(EMPTY)
    sh("systemctl", "daemon-reload")
    sh("systemctl", "start", "empty.service")
    empty = (ready_s("empty.service"), pss_mb("empty.service"), _ends())
    offs = dict(line.split() for line in KEPT.read_text().splitlines())
    found = ["empty {:.2f} s, {:.0f} MB, {:.2f} s".format(*empty)]
    for name in SERVICES[:3]:
        ours = (ready_s(unit(name)), pss_mb(unit(name)), float(offs[name]))
        times = [one / other for one, other in zip(ours, empty, strict=True)]
        found.append("{} {:.1f}, {:.1f} and {:.1f} times that".format(name, *times))
        if any(one > most for one, most in zip(times, MOST, strict=True)):
            raise Wrong(f"more than {MOST} times: {'; '.join(found)}")
    return "; ".join(found)


def _ends() -> float:
    """Return the time (s) from kill -9 of the empty service to the end of its ExecStopPost."""
    done, when = Path("/run/empty"), time.monotonic()
    done.unlink(missing_ok=True)
    kill("empty.service", "KILL")
    until(lambda: done.exists() and done.read_text(), "ExecStopPost is done")
    return float(done.read_text()) - when


def pss_mb(service: str) -> float:
    """Return the service's share of the memory (MB), as Pss of smaps_rollup."""
    text = Path(f"/proc/{pid(service)}/smaps_rollup").read_text()
    return int(re.findall(r"^Pss: +(\d+) kB", text, re.MULTILINE)[0]) / 1000
