"""Deaths of a daemon whose relays are on. "Off" is a write that the kernel has traced."""

from collections.abc import Callable, Mapping
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.rides import energise
from tests.vm.guest.system import (
    Wrong,
    back,
    cursor,
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
KILLED_S, STOPPED_S = 1.0, 4.0
"""What docs/reliability.md promises of a core of 1,000 MIPS."""


def kill_9() -> str:
    """kill -9, two relays on: off, and the service is back."""
    took = _dies(lambda: kill(SERVICE, "KILL"))
    keep("lift", took)
    return f"off after {took:.2f} s"


def hang() -> str:
    """SIGSTOP, two relays on: the watchdog ends it; off, and the service is back."""
    return f"off after {_dies(lambda: kill(SERVICE, 'STOP'), STOPPED_S):.2f} s"


def crash() -> str:
    """A crash in C code (SIGSEGV by the kernel), two relays on: off, and the service is back."""
    return f"off after {_dies(lambda: kill(SERVICE, 'SEGV')):.2f} s"


def out_of_memory() -> str:
    """The unit's memory is used up, two relays on: off, and the service is back."""
    limit = Path(f"/sys/fs/cgroup{shown(SERVICE, 'ControlGroup')['ControlGroup']}/memory.max")
    before = limit.read_text()

    def starve() -> None:
        limit.write_text("4M")  # the kernel returns when it has killed
        limit.write_text(before)

    took = _dies(starve)
    sh("journalctl", "-k", "--no-hostname", "-g", "Memory cgroup out of memory")
    return f"off after {took:.2f} s"


def _dies(act: Callable[[], object], within_s: float = KILLED_S) -> float:
    """`act` ends the daemon while two relays are on; how long until they were off (s)."""
    relays, old = energise(), pid(SERVICE)
    when = header.now()
    act()
    took = off_after(relays, when, within_s)
    back(SERVICE, old)
    return took


def off_after(relays: Mapping[int, bool], when: float, within_s: float = KILLED_S) -> float:
    """How long after `when` (s) the last of these relays was written off."""
    found = until(lambda: _all_off(relays, when), "each relay is written off", 30.0)
    took = max(found.values()) - when
    if took > within_s:
        raise Wrong(f"off after {took:.2f} s, more than {within_s:g}")
    return took


def _all_off(relays: Mapping[int, bool], when: float) -> dict[int, float]:
    found = header.off_at(relays, when)
    return found if found.keys() == relays.keys() else {}


def clean_stop() -> str:
    """`systemctl stop`, two relays on: off by the daemon; `outputs-off` has nothing to do."""
    relays, mark = energise(), cursor()
    when = header.now()
    sh("systemctl", "stop", SERVICE)
    stopped = header.now() - when
    took = off_after(relays, when)
    text = journal(mark, SERVICE)
    if "nothing_to_switch_off" not in text:
        raise Wrong("outputs-off ran once more")
    sh("systemctl", "start", SERVICE)
    return f"off after {took:.2f} s, stopped after {stopped:.2f} s"


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
