"""Examine the kernel's CAN interfaces (SocketCAN). An interface must be present, up, at the right
bitrate, and able to recover."""

from collections.abc import Iterator
from typing import Final

import msgspec

from workbench.commissioning.doctor.finding import Finding, note, ok, warning, wrong
from workbench.commissioning.doctor.machine import Machine

CAN: Final = "can"
ARPHRD_CAN: Final = "280"
"""The kernel's number for the interface type CAN (linux/if_arp.h)."""
IFF_UP: Final = 1
DEAF: Final = "no station on this bus is heard"
HOW: Final = 'docs/how-to/wire.md, "CAN": sudo ip link set {} up type can bitrate {} restart-ms 100'


def interface(machine: Machine, name: str, bitrate: int | None) -> Iterator[Finding]:
    """Examine the CAN interface `name`. `bitrate` is the stations' bitrate (bit/s), or None if each
    site chooses its bitrate."""
    rate = str(bitrate or "250000")
    folder = f"/sys/class/net/{name}"
    if not machine.at(folder).is_dir():
        kinds = (one for one in machine.folder("/sys/class/net") if _is_can(machine, one.name))
        seen = ", ".join(one.name for one in kinds) or "none"
        do = "the CAN board's dtoverlay in config.txt; ip link show type can"
        yield wrong(CAN, f"there is no interface {name}; CAN interfaces here: {seen}", DEAF, do)
        return
    if not _is_can(machine, name):
        yield wrong(
            CAN,
            f"{name} is not a CAN interface",
            DEAF,
            "write the name of a CAN interface under socketcan:",
        )
        return
    if not int(machine.text(f"{folder}/flags") or "0", 16) & IFF_UP:
        yield wrong(CAN, f"{name} is down", DEAF, HOW.format(name, rate))
        return
    details = _details(machine, name)
    if details is None:
        found = f"{name} is up; only the command ip can show its bitrate"
        yield note(CAN, found, "", "sudo apt install iproute2")
    elif details.kind != "can":
        yield note(CAN, f"{name} is up, but is {details.kind}, without a wire")
    else:
        yield from _controller(name, details.told, bitrate)


class _Timing(msgspec.Struct, frozen=True):
    bitrate: int = 0


class Controller(msgspec.Struct, frozen=True):
    """State of a CAN controller, as `ip -details` prints it."""

    state: str = "?"
    bittiming: _Timing = _Timing()
    restart_ms: int = 0


class _LinkInfo(msgspec.Struct, frozen=True):
    info_kind: str = "?"
    info_data: Controller = Controller()


class _Link(msgspec.Struct, frozen=True):
    linkinfo: _LinkInfo = _LinkInfo()


class _Details(msgspec.Struct, frozen=True):
    kind: str
    told: Controller


def _details(machine: Machine, name: str) -> _Details | None:
    printed = machine.printed("ip", "-j", "-details", "link", "show", name)
    try:
        (link,) = msgspec.json.decode(printed or "[]", type=list[_Link])
    except (msgspec.MsgspecError, ValueError):
        return None
    return _Details(link.linkinfo.info_kind, link.linkinfo.info_data)


def _controller(name: str, told: Controller, bitrate: int | None) -> Iterator[Finding]:
    rate = told.bittiming.bitrate
    how = HOW.format(name, bitrate or rate)
    if bitrate is not None and rate != bitrate:
        found = f"{name} has {rate} bit/s, but the stations' default is {bitrate} bit/s"
        yield warning(CAN, found, "one station at another bitrate stops the whole bus", how)
    else:
        yield ok(CAN, f"{name} is up at {rate} bit/s; the stations need the same bitrate")
    state = told.state.upper()
    check = "bitrate, termination (60 Ω between CAN_H and CAN_L with everything off), cable, supply"
    if state == "BUS-OFF":
        yield wrong(
            CAN, f"{name} is bus-off: the controller has left the bus", DEAF, f"{check}; then {how}"
        )
    elif state not in ("ERROR-ACTIVE", "?"):
        yield warning(CAN, f"{name} is {state.lower()}", "the controller counts many errors", check)
    if not told.restart_ms:
        means = "after a bus-off the interface hears nothing until somebody sets it down and up"
        yield warning(CAN, f"{name} has no restart-ms", means, how)


def _is_can(machine: Machine, name: str) -> bool:
    return machine.text(f"/sys/class/net/{name}/type") == ARPHRD_CAN
