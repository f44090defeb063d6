"""Deaths of a daemon that has switched relays on. The checks take a relay as off when the kernel's
trace shows that a process wrote "off" to its line."""

import os
import signal
from collections.abc import Callable, Mapping
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.rides import HELD, LIFT, asking, energise
from tests.vm.guest.system import (
    Wrong,
    back,
    cursor,
    heard,
    journal,
    keep,
    kill,
    pid,
    sh,
    shown,
    unit,
    until,
)

SERVICE = unit("lift")
MODE, HOLD = {18}, set(HELD)
"""Sets of outputs that are on together. MODE is the AGV mode alone. HOLD is the AGV mode and the output
that holds the door open."""
ODD = 5
"""The input with the lowest bit of the floor code. Its level becomes low when the car passes L2."""
KILLED_S, STOPPED_S = 1.0, 4.0
"""Limits (s) in docs/explanation/reliability.md for a core of 1,000 MIPS."""


def phases() -> str:
    """Kill the service with -9 in each phase of a ride, during a start, and after END. Check that the
    relays go off each time and that the service returns."""
    took = {}
    with asking("lift", "Lift1", "L3", "--session", "vm/robot"):
        took["mode asked for"] = _dies_with(set(), MODE)
        took["car moving"] = _dies_with(MODE, MODE | {24}, at=lambda: not header.level(ODD))
        took["door held"] = _dies_with(MODE, HOLD)
        took["start"] = _dies_at_start()
    with asking("lift", "Lift1", "--end", "--session", "vm/robot"):
        took["after END"] = _dies_with(HOLD, MODE)
    keep("lift", took["door held"])
    return "off after " + ", ".join(f"{s:.2f} s ({phase})" for phase, s in took.items())


def _dies_with(*outputs: set[int], at: Callable[[], bool] = lambda: True) -> float:
    """Kill the service with -9. First wait until these sets of outputs have been on one after the
    other, and until `at` returns True. Return the time until the relays are off (s)."""
    old = pid(SERVICE)
    _on(*outputs, at=at)
    return _killed(old, outputs[-1])


def _on(*outputs: set[int], at: Callable[[], bool] = lambda: True) -> None:
    """Wait until the last sets of outputs that were on are these sets, in this order, and `at` returns
    True."""
    until(
        lambda: header.together(LIFT)[-len(outputs) :] == [*outputs] and at(),
        f"lines {outputs} are on, one set after the other",
        pause_s=0.02,
    )


def _killed(old: int, relays: set[int]) -> float:
    when = header.now()
    os.kill(old, signal.SIGKILL)
    took = off_after({line: LIFT[line] for line in relays}, when)
    back(SERVICE, old)
    return took


def _dies_at_start() -> float:
    """Kill a daemon with -9 during its start, while the relays are still on. Return the time (s) until
    the relays are off.

    The start of a daemon with relays on needs two earlier kills:

    1. Kill the daemon that serves. Then systemd runs `outputs-off`, a process that would switch the
       relays off.
    2. Kill this `outputs-off`, so that the relays stay on. Then systemd starts the next daemon.

    The next daemon begins with an `outputs-off` of its own. While this `outputs-off` runs, kill the
    daemon.
    """
    old, running = pid(SERVICE), _group() / "cgroup.procs"
    _on(MODE, HOLD)
    when = header.now()

    def others() -> set[int]:
        return (
            {int(word) for word in running.read_text().split()} - {old}
            if running.exists()
            else set()
        )

    os.kill(old, signal.SIGKILL)
    post = until(others, "outputs-off runs after the death", pause_s=0.02)
    for each in post:
        os.kill(each, signal.SIGKILL)
    until(lambda: len(others() - post) > 1, "the next daemon runs outputs-off", pause_s=0.02)
    if header.off_at(LIFT, when):
        raise Wrong("the relays were off before the start")
    return _killed(pid(SERVICE), HOLD)


def _group() -> Path:
    """Return the service's control group."""
    return Path(f"/sys/fs/cgroup{shown(SERVICE, 'ControlGroup')['ControlGroup']}")


def hang() -> str:
    """Check that the relays go off after the daemon hangs with two relays on, because the watchdog
    kills it."""
    return f"off after {_dies(lambda: kill(SERVICE, 'STOP'), STOPPED_S):.2f} s"


def crash() -> str:
    """Check that two relays go off and the service returns after the daemon crashes in C code
    (SIGSEGV)."""
    return f"off after {_dies(lambda: kill(SERVICE, 'SEGV')):.2f} s"


def out_of_memory() -> str:
    """Check that two relays go off and the service returns after the service has run out of memory."""
    limit = _group() / "memory.max"
    before = limit.read_text()

    def starve() -> None:
        limit.write_text("4M")  # this write returns only after the kernel has killed the daemon
        limit.write_text(before)

    took = _dies(starve)
    sh("journalctl", "-k", "--no-hostname", "-g", "Memory cgroup out of memory")
    return f"off after {took:.2f} s"


def _dies(act: Callable[[], object], within_s: float = KILLED_S) -> float:
    """Let `act` end the daemon when two relays are on. Return the time until both relays were off
    (s)."""
    relays, old = energise(), pid(SERVICE)
    when = header.now()
    act()
    took = off_after(relays, when, within_s)
    back(SERVICE, old)
    return took


def off_after(relays: Mapping[int, bool], when: float, within_s: float = KILLED_S) -> float:
    """Return the time from `when` until the last of these relays was written off (s)."""
    found = until(lambda: _all_off(relays, when), "each relay is written off", 30.0)
    took = max(found.values()) - when
    if took > within_s:
        raise Wrong(f"off after {took:.2f} s, more than {within_s:g}")
    return took


def _all_off(relays: Mapping[int, bool], when: float) -> dict[int, float]:
    found = header.off_at(relays, when)
    return found if found.keys() == relays.keys() else {}


def clean_stop() -> str:
    """Check that `systemctl stop` makes the daemon switch two relays off. So `outputs-off` finds no
    relay that is on."""
    relays, mark = energise(), cursor()
    when = header.now()
    sh("systemctl", "stop", SERVICE)
    stopped = header.now() - when
    took = off_after(relays, when)
    text = journal(mark, SERVICE)
    if "nothing_to_switch_off" not in text:
        raise Wrong("outputs-off switched off again")
    sh("systemctl", "start", SERVICE)
    return f"off after {took:.2f} s, stopped after {stopped:.2f} s"


def two_on_one_pin() -> str:
    """Check that `enable` refuses a second service on the lift's pins. If this service is started by
    hand, it must name the process that holds the pins."""
    copy = Path("/etc/rmf-bridges/second.yaml")
    copy.write_text(Path("/etc/rmf-bridges/lift.yaml").read_text().replace("Lift1", "Lift2"))
    sh("rmf-bridge", "enable", str(copy), fails=True)
    before = pid(SERVICE)
    service, mark = unit("second"), cursor()
    drop_in = Path(f"/run/systemd/system/{service}.d/10-enable.conf")
    drop_in.parent.mkdir(parents=True)
    drop_in.write_text(Path(f"/etc/systemd/system/{SERVICE}.d/10-enable.conf").read_text())
    sh("systemctl", "daemon-reload")
    sh("systemctl", "start", "--no-block", service)
    heard(mark, service, f"{SERVICE}|held by")
    sh("systemctl", "stop", service)
    drop_in.unlink()
    copy.unlink()
    sh("systemctl", "daemon-reload")
    if pid(SERVICE) != before:
        raise Wrong("the first service did not keep running")
    return "the first one serves on"
