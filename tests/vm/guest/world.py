"""What happens around a service: its file, its disks, its clock, its network."""

import re
import time
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.rides import LIFT, energise, ride
from tests.vm.guest.system import (
    Wrong,
    back,
    disable,
    enable,
    far_side,
    is_active,
    pid,
    sh,
    unit,
    until,
)

SERVICE = unit("lift")
YAML = Path("/etc/rmf-bridges/lift.yaml")


def edited_yaml() -> str:
    """The file's pins are edited while a relay is on, then kill -9: the old pins are switched off."""
    began, old, text = energise(), pid(SERVICE), YAML.read_text()
    held = sorted(header.on(LIFT, began))
    YAML.write_text(text.replace("BCM18", "BCM25").replace("BCM16", "BCM26"))
    when = header.now()
    sh("systemctl", "kill", "-s", "KILL", "--kill-whom=main", SERVICE)
    until(lambda: sorted(header.off_at(dict.fromkeys(held, True), when)) == held, "old pins off")
    back(SERVICE, old)
    new = {each.line for each in header.writes(when)} & {25, 26}
    YAML.write_text(text)
    sh("systemctl", "restart", SERVICE)
    if held != [16, 18] or new != {25, 26}:
        raise Wrong(f"held {held}, new pins {new}")
    return "old pins off, the service is back with the new ones"


def labels() -> str:
    """The header's chip is found by its label: Raspberry Pi 3, 4 and 5."""
    sh("systemctl", "stop", SERVICE, "far-lift.service")
    for label in header.LABELS:
        header.unplug()
        header.plug(label)
        sh("udevadm", "settle")
        _claims(label)
    header.unplug()
    header.plug(header.PI_4)
    sh("udevadm", "settle")
    far_side("lift")
    sh("systemctl", "start", SERVICE)
    return ", ".join(header.LABELS)


def _claims(label: str) -> None:
    """Start the service until it has written each output, and stop it."""
    when = header.now()
    sh("systemctl", "start", SERVICE)
    until(
        lambda: {each.line for each in header.writes(when)} >= LIFT.keys(),
        f"the outputs are claimed on {label}",
    )
    sh("systemctl", "stop", SERVICE)


def clock() -> str:
    """The clock steps by ten years, forth and back, with two relays on: nothing moves."""
    began, old = energise(), pid(SERVICE)
    for years in (10, -20, 10):
        sh("date", "-s", f"{years:+d} years")
        time.sleep(4)
        on = sorted(header.on(LIFT, began))
        if on != [16, 18] or pid(SERVICE) != old:
            raise Wrong(
                f"after {years:+d} years: on are {on}, the process was {old}: {pid(SERVICE)}"
            )
    ride()
    return "two relays stayed on, no restart, then a ride"


def full_run() -> str:
    """/run is full: the daemon serves, dies by kill -9, is off, and is back once there is room."""
    began, old = energise(), pid(SERVICE)
    filler = Path("/run/filler")
    with filler.open("wb") as out:
        try:
            while True:
                out.write(bytes(1 << 16))
                out.flush()
        except OSError:
            pass
    when = header.now()
    try:
        sh("systemctl", "kill", "-s", "KILL", "--kill-whom=main", SERVICE)
        relays = {16: True, 18: True}
        off = until(lambda: _all(header.off_at(relays, when), relays), "each relay is off", 30.0)
        alive = header.on(LIFT, began)
    finally:
        filler.unlink()
    back(SERVICE, old)
    if alive:
        raise Wrong(f"on: {alive}")
    return f"off after {max(off.values()) - when:.2f} s, back"


def _all(found: dict[int, float], lines: dict[int, bool]) -> dict[int, float]:
    return found if found.keys() == lines.keys() else {}


def read_only_root() -> str:
    """The root file system is read only: the service starts, serves, and switches off."""
    sh("systemctl", "stop", SERVICE)
    sh("mount", "-o", "remount,ro", "/", fails=False)
    try:
        sh("systemctl", "start", SERVICE)
        until(lambda: is_active(SERVICE), "the service is ready")
        ride()
    finally:
        sh("mount", "-o", "remount,rw", "/")
    return "a ride"


def network() -> str:
    """The service starts without a network. One comes, later with another address: it is reached."""
    sh("ip", "netns", "add", "site")
    sh("ip", "link", "add", "eth0", "type", "veth", "peer", "name", "eth1", "netns", "site")
    far_side("far")
    enable("far")
    text = []
    for address in ("10.7.0", "10.8.0"):
        sh("ip", "addr", "flush", "dev", "eth0")
        sh("ip", "addr", "add", f"{address}.2/24", "dev", "eth0")
        sh("ip", "link", "set", "eth0", "up")
        sh("ip", "-n", "site", "link", "set", "lo", "up")
        sh("ip", "-n", "site", "addr", "flush", "dev", "eth1")
        sh("ip", "-n", "site", "addr", "add", f"{address}.3/24", "dev", "eth1")
        sh("ip", "-n", "site", "link", "set", "eth1", "up")
        began = time.monotonic()
        send = ("rmf-bridge", "send", "door", "far_door", "open", "--direct", "--domain-id", "8")
        sh("ip", "netns", "exec", "site", *send)
        text.append(f"{time.monotonic() - began:.1f}")
    disable("far")
    return f"a request is fulfilled {text[0]} and {text[1]} s after each address"


def said() -> str:
    """The journal is readable: a line for each event, key=value, no traceback."""
    text = sh("journalctl", "-b", "-u", SERVICE, "-o", "cat")
    if "Traceback" in text:
        raise Wrong("a traceback")
    lines = text.splitlines()
    longest = max(map(len, lines))
    events = sum(bool(re.search(r"\w+=\S", line)) for line in lines)
    return (
        f"{len(lines)} lines, {events} of them with key=value, the longest has {longest} characters"
    )
