"""Examine serial ports, which lead to RS-485 lines or to CAN adapters that speak slcan."""

import re
from collections.abc import Iterator
from typing import Final

from drivers.hal.gpio.holders import holders
from workbench.commissioning.doctor.finding import Finding, ok, warning, wrong
from workbench.commissioning.doctor.machine import Machine
from workbench.commissioning.doctor.users import User, group_of, join

PORT: Final = "serial port"
BY_ID: Final = "/dev/serial/by-id"
DEAF: Final = "nobody on this line is heard"


def port(machine: Machine, path: str, who: User, *, served: bool) -> Iterator[Finding]:
    """Examine a serial port. `served` tells whether a running daemon of this file has the port open."""
    if not machine.at(path).exists():
        seen = ", ".join(machine.named(one) for one in machine.folder(BY_ID))
        do = (
            f"plug it in, or write one of: {seen}"
            if seen
            else "plug it in; then ls /dev/serial/by-id"
        )
        yield wrong(PORT, f"{path} is not there", DEAF, do)
        return
    device = machine.target(path)
    yield _permission(machine, path, device, who)
    yield from _stable(machine, path, device)
    if device in _consoles(machine):
        do = "sudo raspi-config: no login shell over serial; or remove console= from cmdline.txt"
        yield wrong(
            PORT,
            f"the kernel's console is on {device}",
            "the console's texts go out on the line",
            do,
        )
    others = [] if served else holders(machine.at(device), machine.at("/proc"))
    if others:
        found = f"{device} is open in {' and '.join(others)}"
        yield wrong(PORT, found, "two masters spoil each other's frames", "stop that program")


def _permission(machine: Machine, path: str, device: str, who: User) -> Finding:
    state = machine.at(device).stat()
    if who.may(state):
        return ok(PORT, f"{path} is there, and {who.name} may use this port")
    group = group_of(machine, state.st_gid)
    text = f"{who.name} may not open {device} (mode {state.st_mode & 0o777:o}, group {group})"
    return wrong(PORT, text, DEAF, join(who, group))


def _stable(machine: Machine, path: str, device: str) -> Iterator[Finding]:
    """Warn if the path may name another adapter after the next boot."""
    if not re.match(r"/dev/tty(USB|ACM)", path):
        return
    same = [machine.named(one) for one in machine.folder(BY_ID)]
    same = [name for name in same if machine.target(name) == device]
    do = (
        f"port: {same[0]}" if same else "write as port: the path that ls /dev/serial/by-id/* prints"
    )
    yield warning(
        PORT,
        f"the path {path} contains a number",
        "after the next boot, another adapter may have this number",
        do,
    )


def _consoles(machine: Machine) -> set[str]:
    words = (machine.text("/proc/cmdline") or "").split()
    names = [
        word.removeprefix("console=").split(",")[0] for word in words if word.startswith("console=")
    ]
    return {machine.target(f"/dev/{name}") for name in names}
