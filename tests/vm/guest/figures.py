"""Times and memory beside those of an empty Python service: ratios do not depend on the machine."""

import time
from pathlib import Path

from tests.vm.guest.system import Wrong, pid, pss_mb, ready_s, sh, unit, until

NAMES = ("lift", "door", "charger", "lift_supervisor", "door_supervisor")
WHOLE_MB = 200.0
EMPTY = r"""
[Service]
Type=notify
ExecStart=/usr/bin/python3 -c "\
import os, signal, socket; \
socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM).sendto(b'READY=1', os.environ['NOTIFY_SOCKET']); \
signal.pause()"
ExecStopPost=/usr/bin/python3 -c "import time; open('/run/empty', 'w').write(str(time.monotonic()))"
"""


def memory() -> str:
    """Lift, door, charger and both supervisors together: below 200 MB."""
    each = {name: pss_mb(pid(unit(name))) for name in NAMES}
    whole = sum(each.values())
    text = ", ".join(f"{name} {mb:.0f}" for name, mb in each.items())
    if whole > WHOLE_MB:
        raise Wrong(f"{whole:.0f} MB: {text}")
    return f"{whole:.0f} MB (PSS): {text}"


def empty() -> str:
    """An empty Python service: ready, killed, its ExecStopPost done; its memory."""
    Path("/run/systemd/system/empty.service").write_text(EMPTY)
    sh("systemctl", "daemon-reload")
    sh("systemctl", "start", "empty.service")
    ready, mb = ready_s("empty.service"), pss_mb(pid("empty.service"))
    when = time.monotonic()
    sh("systemctl", "kill", "-s", "KILL", "empty.service")
    done = Path("/run/empty")
    until(lambda: done.exists() and done.read_text(), "ExecStopPost is done")
    off = float(done.read_text()) - when
    return f"ready after {ready:.2f} s, killed to done {off:.2f} s, PSS {mb:.0f} MB"
