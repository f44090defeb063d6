"""A door on RS-485 and a charger on CAN. Their relays are in the equipment at the other end of the
wire."""

import json
import socket
import time
from collections.abc import Callable
from typing import Final

from tests.vm.guest.rides import send
from tests.vm.guest.system import (
    LATE_S,
    Wrong,
    back,
    cursor,
    enable,
    far_side,
    heard,
    keep,
    kill,
    pid,
    ready_s,
    sh,
    unit,
)

KILLED_S: Final = 2.0


def door_service() -> str:
    """Check that `rmf-bridge enable` starts a door on RS-485. The serial port is a pseudo-terminal."""
    far_side("door")
    return f"ready after {ready_s(enable('door')):.2f} s"


def door() -> str:
    """Check that one request holds a door on RS-485 open, and that another request closes it."""
    began = time.monotonic()
    send("door", "ward_door", "open", "--direct")
    opened = time.monotonic() - began
    send("door", "ward_door", "close", "--direct")
    return f"open after {opened:.1f} s"


def door_killed() -> str:
    """Check that the relay at the RS-485 module goes off after kill -9 of the door's service."""
    send("door", "ward_door", "open", "--direct")
    return _killed("door")


def adapter_pulled() -> str:
    """Check that a fault comes when the RS-485 adapter is pulled out. The fault must end when the
    adapter is plugged in again."""
    return _fault_ends(
        "door ward_door usb-rs485",
        lambda: tell("door", "fail ward_door server off"),
        lambda: tell("door", "fail ward_door server ok"),
    )


def charger_service() -> str:
    """Check that `rmf-bridge enable` starts a charger on SocketCAN."""
    sh("ip", "link", "add", "vcan0", "type", "vcan")
    sh("ip", "link", "set", "vcan0", "up")
    far_side("charger")
    return f"ready after {ready_s(enable('charger')):.2f} s"


def charge() -> str:
    """Check that a robot charges on SocketCAN, and that a cancel message ends the charge."""
    _charge("vm-1")
    mark = cursor()
    send("charger", "charger_b", "--cancel", "vm-1")
    heard(mark, unit("charger"), "state=IDLE")
    return "charging, then cancelled"


def _charge(request: str) -> None:
    mark = cursor()
    tell("charger", "press charger_b robot off")
    tell("charger", "press charger_b robot on")
    send("charger", "charger_b", "--robot", "vm/robot", "--request-id", request)
    heard(mark, unit("charger"), "state=CHARGING")


def charger_killed() -> str:
    """Check that the CAN charger gets the command to stop after kill -9 of the charger's service during
    a charge."""
    _charge("vm-2")
    return _killed("charger")


def interface_down() -> str:
    """Check that a fault names the CAN interface when the interface goes down. The fault must end when
    the interface goes up again."""
    return _fault_ends(
        "charger charger_b vcan0",
        lambda: sh("ip", "link", "set", "vcan0", "down"),
        lambda: sh("ip", "link", "set", "vcan0", "up"),
    )


def bus_off() -> str:
    """Check that a fault names the state bus-off when the CAN controller reports it. The fault must end
    when the controller recovers."""
    return _fault_ends(
        "charger charger_b bus-off",
        lambda: tell("charger", "fail charger_b bus wrong"),
        lambda: tell("charger", "fail charger_b bus ok"),
    )


def _fault_ends(what: str, breaks: Callable[[], object], mends: Callable[[], object]) -> str:
    """Break a wire and mend it. The fault must come and end.

    `what` names the service, the device, and a word of the fault.
    """
    name, device, word = what.split()
    mark, began = cursor(), time.monotonic()
    breaks()
    seen = heard(mark, unit(name), f"fault device={device} .*{word}")
    mended = time.monotonic()
    mends()
    over = heard(mark, unit(name), f"fault_over device={device}")
    return f"a fault after {seen - began:.1f} s, over after {over - mended:.1f} s"


def _killed(name: str) -> str:
    service = unit(name)
    old, when = pid(service), time.monotonic()
    took = _relay_off_at(name, lambda: kill(service, "KILL")) - when
    back(service, old)
    if took > KILLED_S:
        raise Wrong(f"off after {took:.2f} s, more than {KILLED_S:g}")
    keep(name, took)
    return f"off after {took:.2f} s"


def _relay_off_at(name: str, act: Callable[[], object]) -> float:
    """Call `act`. Return the time (s, monotonic clock) at which a relay of this simulated equipment
    then goes off."""
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
    """Send a command to simulated equipment (`hal_fakes/control.py`)."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as control:
        control.connect(f"/run/far-{name}")
        control.sendall(words.encode() + b"\n")
        answer = control.recv(1000).decode().strip()
    if answer != "ok":
        raise Wrong(f"{words}: {answer}")
