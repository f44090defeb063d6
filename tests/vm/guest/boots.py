"""What a boot does to relays. The host cuts the power, or lets the machine restart, in between."""

from tests.vm.guest import header
from tests.vm.guest.rides import LIFT, energise
from tests.vm.guest.system import (
    Wrong,
    far_side,
    is_active,
    sh,
    shown,
    unit,
    until,
)

SERVICE = unit("lift")


def energised() -> str:
    """Two relays are on when the machine goes down."""
    return f"lines {sorted(energise())}"


def reboot() -> str:
    """(the machine restarts in good order)"""
    sh("systemctl", "reboot")
    return "it does"


def off() -> str:
    """The machine is up again: no relay has been on since the kernel started."""
    until(lambda: is_active(SERVICE), "the service is ready")
    writes = [each for each in header.writes() if each.line in LIFT]
    on = [each for each in writes if each.level == LIFT[each.line]]
    if on or {each.line for each in writes} != LIFT.keys():
        raise Wrong(f"written on: {on}; written at all: {writes}")
    ready = int(shown(SERVICE, "ActiveEnterTimestampMonotonic")["ActiveEnterTimestampMonotonic"])
    far_side("lift")
    first = min(each.at for each in writes)
    return f"all written off {first:.1f} s after the kernel's start, ready at {ready / 1e6:.1f} s"
