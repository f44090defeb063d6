"""Relays during a boot. Between two checks the host cuts the power or restarts the machine."""

from tests.vm.guest import header
from tests.vm.guest.rides import LIFT, energise, send
from tests.vm.guest.system import (
    Wrong,
    disable,
    enable,
    far_side,
    is_active,
    sh,
    since_boot_s,
    unit,
    until,
)

SERVICE = unit("lift")
LOW = 7
"""The output of low.yaml. A low level switches its relay on."""
STARTS = 10


def energised() -> str:
    """Switch two relays on. The host shuts the machine down afterwards."""
    return f"lines {sorted(energise())}"


def reboot() -> str:
    """Shut the machine down cleanly and restart it."""
    sh("systemctl", "reboot")
    return "it does"


def off() -> str:
    """Check that the machine is up again and that no relay has been on since the kernel started."""
    until(lambda: is_active(SERVICE), "the service is ready")
    writes = [each for each in header.writes() if each.line in LIFT]
    on = [each for each in writes if each.level == LIFT[each.line]]
    if on or {each.line for each in writes} != LIFT.keys():
        raise Wrong(f"lines written on: {on}; all writes: {writes}")
    ready = since_boot_s(SERVICE, "ActiveEnterTimestampMonotonic")
    far_side("lift")
    first = min(each.at for each in writes)
    return f"all written off {first:.1f} s after the kernel's start, ready at {ready:.1f} s"


def active_low() -> str:
    """Check a relay that a low level switches on. It must stay off through ten starts of the service,
    without a pulse. Only a request may switch it on."""
    header.pull(LOW, high=True)  # the resistor on the relay board
    began = header.now()
    service = enable("low")
    for _ in range(STARTS - 1):
        sh("systemctl", "restart", service)
    starts = _written(began)
    asked = header.now()
    send(
        "door", "lab_door", "open", "--direct", "--timeout", "5", fails=True
    )  # the door cannot move
    opened = _written(asked)
    disable("low")
    sh("sync")  # because the host may cut the power next
    if 0 in starts or len(starts) < STARTS or 0 not in opened:
        raise Wrong(f"writes of {STARTS} starts: {starts}; writes after a request: {opened}")
    return f"{len(starts)} writes, all of them high; a request wrote {opened[0]}"


def _written(since: float) -> list[int]:
    return [each.level for each in header.writes(since) if each.line == LOW]
