"""What services are for: requests from other processes, and equipment that does as it is told."""

import json
import socket
import time
from collections.abc import Callable
from pathlib import Path

from tests.vm.guest import header
from tests.vm.guest.system import LATE_S, Wrong, cursor, journal, sh, unit, until

ROOM = ("--domain-id", "7", "--localhost")
LIFT = dict.fromkeys((18, 16, 22, 23, 24), True)
"""The outputs of lift.yaml: each is on at high."""
AGV, DOOR = 18, 16


def send(*words: str) -> str:
    """A request of RMF's, and its effect."""
    return sh("rmf-bridge", "send", *words, *ROOM)


def ride() -> str:
    """A robot rides from L1 to L3: requests from outside of the service, lines of the header."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    send("lift", "Lift1", "L3", "--session", "vm/robot", "--direct")
    held = sorted(header.on(LIFT, began))
    send("lift", "Lift1", "--end", "--session", "vm/robot", "--direct")
    until(lambda: not header.on(LIFT, began), "every output is off after the session")
    called = [each.line for each in header.writes(began) if each.level and each.line in (22, 24)]
    if held != [DOOR, AGV] or called != [22, 24]:
        raise Wrong(f"held at L3: {held}, calls: {called}")
    return "to L1, to L3, doors held there, all off after the end"


def energise() -> float:
    """A session of the lift holds two relays; returns the time before that."""
    began = header.now()
    send("lift", "Lift1", "L1", "--session", "vm/robot", "--direct")
    until(lambda: len(header.on(LIFT, began)) == 2, "two relays are on")
    return began


def door() -> str:
    """A door on RS-485 is held open, and closes."""
    began = time.monotonic()
    send("door", "ward_door", "open", "--direct")
    opened = time.monotonic() - began
    send("door", "ward_door", "close", "--direct")
    return f"open after {opened:.1f} s"


def charge() -> str:
    """A robot is charged on SocketCAN, and the charge is cancelled."""
    tell("charger", "press charger_b robot on")
    send("charger", "charger_b", "--robot", "vm/robot", "--request-id", "vm-1")
    until(lambda: "state CHARGING" in sh("rmf-bridge", "status", "charger"), "it charges")
    send("charger", "charger_b", "--cancel", "vm-1")
    return "charging, then cancelled"


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
