"""Deaths of a daemon whose relays are on. "Off" is a write that the kernel has traced."""

from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.rides import LIFT, energise
from tests.vm.guest.system import (
    Wrong,
    back,
    cursor,
    disable,
    enable,
    far_side,
    journal,
    pid,
    sh,
    shown,
    unit,
    until,
)

SERVICE = unit("lift")
KILLED_S, STOPPED_S = 1.0, 4.0
"""What docs/reliability.md promises of a core of 1,000 MIPS."""


def _off_after(began: float, when: float, within_s: float) -> float:
    """How long after `when` (s) the last of the relays that were on was written off."""
    relays = {line: LIFT[line] for line in header.on(LIFT, began)}
    if not relays:
        relays = {each.line: True for each in header.writes(began) if each.level}
    found = until(lambda: _all_off(relays, when), "each relay is written off", 30.0)
    took = max(found.values()) - when
    if took > within_s:
        raise Wrong(f"off after {took:.2f} s, more than {within_s:g}")
    return took


def _all_off(relays: dict[int, bool], when: float) -> dict[int, float]:
    found = header.off_at(relays, when)
    return found if found.keys() == relays.keys() else {}


def kill_9() -> str:
    """kill -9, two relays on: off, and the service is back."""
    began, old = energise(), pid(SERVICE)
    when = header.now()
    sh("systemctl", "kill", "-s", "KILL", "--kill-whom=main", SERVICE)
    took = _off_after(began, when, KILLED_S)
    back(SERVICE, old)
    return f"off after {took:.2f} s"


def hang() -> str:
    """SIGSTOP, two relays on: the watchdog ends it; off, and the service is back."""
    began, old = energise(), pid(SERVICE)
    when = header.now()
    sh("systemctl", "kill", "-s", "STOP", "--kill-whom=main", SERVICE)
    took = _off_after(began, when, STOPPED_S)
    back(SERVICE, old)
    return f"off after {took:.2f} s"


def crash() -> str:
    """A crash in C code (SIGSEGV by the kernel), two relays on: off, and the service is back."""
    began, old = energise(), pid(SERVICE)
    when = header.now()
    sh("systemctl", "kill", "-s", "SEGV", "--kill-whom=main", SERVICE)
    took = _off_after(began, when, KILLED_S)
    back(SERVICE, old)
    return f"off after {took:.2f} s"


def out_of_memory() -> str:
    """The unit's memory is used up, two relays on: off, and the service is back."""
    began, old = energise(), pid(SERVICE)
    limit = Path(f"/sys/fs/cgroup{shown(SERVICE, 'ControlGroup')['ControlGroup']}/memory.max")
    before = limit.read_text()
    when = header.now()
    limit.write_text("4M")  # the kernel returns when it has killed
    limit.write_text(before)
    took = _off_after(began, when, KILLED_S)
    back(SERVICE, old)
    sh("journalctl", "-k", "--no-hostname", "-g", "Memory cgroup out of memory")
    return f"off after {took:.2f} s"


def clean_stop() -> str:
    """`systemctl stop`, two relays on: off by the daemon; `outputs-off` has nothing to do."""
    began, mark = energise(), cursor()
    when = header.now()
    sh("systemctl", "stop", SERVICE)
    stopped = header.now() - when
    took = _off_after(began, when, KILLED_S)
    text = journal(mark, SERVICE)
    if "nothing_to_switch_off" not in text:
        raise Wrong("outputs-off ran once more")
    sh("systemctl", "start", SERVICE)
    return f"off after {took:.2f} s, stopped after {stopped:.2f} s"


def energised() -> str:
    """(two relays are on when the machine goes down)"""
    energise()
    Path("/var/lib/rmf-was-on").touch()
    sh("sync")
    return "two relays on"


def reboot() -> str:
    """(the machine restarts in good order)"""
    sh("systemctl", "reboot")
    return "it does"


def off_at_boot() -> str:
    """The machine is up again: no relay has been on since the kernel started."""
    Path("/var/lib/rmf-was-on").unlink()
    until(lambda: shown(SERVICE, "ActiveState")["ActiveState"] == "active", "the service is ready")
    on = [each for each in header.writes() if LIFT.get(each.line) == bool(each.level)]
    off = sorted({each.line for each in header.writes() if each.line in LIFT})
    if on or off != sorted(LIFT):
        raise Wrong(f"written on: {on}; written off: {off}")
    text = sh("journalctl", "-b", "-u", SERVICE, "--no-hostname")
    by = "by the dead daemon's record" if "outputs_off" in text else "as claimed"
    ready_at = int(shown(SERVICE, "ActiveEnterTimestampMonotonic")["ActiveEnterTimestampMonotonic"])
    first = min(each.at for each in header.writes() if each.line in LIFT)
    return f"all written off {by} at {first:.1f} s, ready at {ready_at / 1e6:.1f} s"


def equipment() -> str:
    """(the lift stands at its wires again)"""
    far_side("lift")
    return "it does"


def active_low() -> str:
    """Ten starts with a relay that is on at low: never on, not for a moment."""
    lines = {7: False}
    service, began = enable("low"), header.now()
    for _ in range(9):
        sh("systemctl", "restart", service)
    found = [each for each in header.writes(began - 30) if each.line in lines]
    glitches = [each for each in found if not each.level]
    disable("low")
    if glitches or len(found) < 10:
        raise Wrong(f"{len(glitches)} of {len(found)} writes switched it on")
    return f"{len(found)} writes, all of them high"


def two_on_one_pin() -> str:
    """Another service on the lift's pins: refused by `enable`; by hand it says who has the pin."""
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
    until(
        lambda: SERVICE in journal(mark, service) or "held by" in journal(mark, service),
        "the holder's name",
    )
    sh("systemctl", "stop", service)
    drop_in.unlink()
    copy.unlink()
    sh("systemctl", "daemon-reload")
    if pid(SERVICE) != before:
        raise Wrong("the first service did not live on")
    return "the first one serves on"
