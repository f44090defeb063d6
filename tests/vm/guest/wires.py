"""A door on RS-485 and a charger on CAN: services whose relays are at the far end of a wire."""

import json
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tests.vm.guest.rides import send
from tests.vm.guest.system import (
    LATE_S,
    Wrong,
    back,
    cursor,
    enable,
    far_side,
    journal,
    pid,
    ready_s,
    sh,
    unit,
    until,
)

KILLED_S: Final = 2.0


def door_service() -> str:
    """`rmf-bridge enable` for a door on RS-485, whose port is a pseudo-terminal."""
    far_side("door")
    return f"ready after {ready_s(enable('door')):.2f} s"


def door() -> str:
    """A door on RS-485 is held open, and closes."""
    began = time.monotonic()
    send("door", "ward_door", "open", "--direct")
    opened = time.monotonic() - began
    send("door", "ward_door", "close", "--direct")
    return f"open after {opened:.1f} s"


def door_killed() -> str:
    """kill -9 of a door's service while a relay on RS-485 is on: off at the module."""
    send("door", "ward_door", "open", "--direct")
    return _killed("door")


def adapter_pulled() -> str:
    """The RS-485 adapter is pulled and plugged again: a fault with a name, then none."""
    mark = cursor()
    tell("door", "fail ward_door server off")
    until(lambda: "ward_door" in journal(mark, unit("door")), "the log names the door")
    tell("door", "fail ward_door server ok")
    began = time.monotonic()
    Path("/dev/pts/0").chmod(0o666)
    until(lambda: _is_well("door"), "the door is back")
    return f"back after {time.monotonic() - began:.1f} s"


def charger_service() -> str:
    """`rmf-bridge enable` for a charger on SocketCAN."""
    sh("ip", "link", "add", "vcan0", "type", "vcan")
    sh("ip", "link", "set", "vcan0", "up")
    far_side("charger")
    return f"ready after {ready_s(enable('charger')):.2f} s"


def charge() -> str:
    """A robot is charged on SocketCAN, and the charge is cancelled."""
    tell("charger", "press charger_b robot on")
    send("charger", "charger_b", "--robot", "vm/robot", "--request-id", "vm-1")
    until(lambda: "state CHARGING" in sh("rmf-bridge", "status", "charger"), "it charges")
    send("charger", "charger_b", "--cancel", "vm-1")
    return "charging, then cancelled"


def charger_killed() -> str:
    """kill -9 of a charger's service during a charge on CAN: the receiver is told to stop."""
    tell("charger", "press charger_b robot on")
    send("charger", "charger_b", "--robot", "vm/robot", "--request-id", "vm-2")
    return _killed("charger")


def interface_down() -> str:
    """CAN's interface goes down during a charge and comes back: a fault with a name, then none."""
    mark = cursor()
    sh("ip", "link", "set", "vcan0", "down")
    until(lambda: "vcan0" in journal(mark, unit("charger")), "the log names the interface")
    sh("ip", "link", "set", "vcan0", "up")
    began = time.monotonic()
    until(lambda: _is_well("charger"), "the charger is back")
    return f"back {time.monotonic() - began:.1f} s after the interface"


def bus_off() -> str:
    """CAN's controller reports bus-off and its end: a fault, then none."""
    mark = cursor()
    tell("charger", "fail charger_b bus wrong")
    until(lambda: "bus-off" in journal(mark, unit("charger")), "the log says bus-off")
    tell("charger", "fail charger_b bus ok")
    began = time.monotonic()
    until(lambda: _is_well("charger"), "the charger is back")
    return f"back after {time.monotonic() - began:.1f} s"


def _killed(name: str) -> str:
    service = unit(name)
    old, when = pid(service), time.monotonic()
    took = (
        relay_off_at(
            name, lambda: sh("systemctl", "kill", "-s", "KILL", "--kill-whom=main", service)
        )
        - when
    )
    back(service, old)
    if took > KILLED_S:
        raise Wrong(f"off after {took:.2f} s, more than {KILLED_S:g}")
    return f"off after {took:.2f} s"


def _is_well(name: str) -> bool:
    """Whether `rmf-bridge status` finds no fault of this service."""
    try:
        sh("rmf-bridge", "status", name)
    except Wrong:
        return False
    return True


def relay_off_at(name: str, act: Callable[[], object]) -> float:
    """When a relay of this far side goes off after `act` (monotonic s)."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control, control.makefile() as lines:
        control.settimeout(LATE_S)
        control.connect(f"/run/far-{name}")
        control.sendall(b"follow\n")
        lines.readline()
        act()
        for line in lines:
            edge = json.loads(line)
            if edge["what"] == "relay" and not edge["value"]:
                return float(edge["at"])
    raise Wrong(f"the far side of {name} has hung up")


def tell(name: str, words: str) -> None:
    """A story for a far side (`hal_fakes/control.py`)."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
        control.connect(f"/run/far-{name}")
        control.sendall(words.encode() + b"\n")
        answer = control.recv(1000).decode().strip()
    if answer != "ok":
        raise Wrong(f"{words}: {answer}")
