"""`rmf-bridge status` prints the state that RMF sees of each daemon on this machine. It also prints
faults and remedies.

The command reads the daemons' status files and asks systemd. It opens no bus and joins no graph.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final, TextIO

import msgspec

from bridges.messages.words import printable
from bridges.runtime.daemons import NONE, DaemonStatus, daemons, units
from bridges.runtime.daemons import folders as daemon_folders
from bridges.runtime.faults import Remedy, here, remedies, values
from bridges.runtime.services import service_name
from bridges.runtime.subject import Status
from bridges.system.log import plain
from bridges.system.paint import bold, red

IN_USE: Final[Mapping[str, tuple[str, ...]]] = {
    "lift": ("session",),
    "door": ("hold",),
    "charger": ("request", "robot"),
    "lift_supervisor": ("session", "holder", "ending", "waiting"),
    "door_supervisor": ("held_by",),
    "charger_coordinator": ("queue",),
    "dispenser": ("mode", "queue"),
    "ingestor": ("mode", "queue"),
    "alarm": (),
    "fleet": ("doing",),
}
"""The keys of the status that tell by whom a device is used, for each kind. A device of any other kind
always counts as in use."""
FREE: Final = ("-", "off", "", "IDLE", "nothing")
IDLE, BUSY = 0, 4
NOT_TOLD: Final = ("contacts", "counts", "faults", "input_age_s", "outputs", "refused")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options of `status`."""
    parser.add_argument(
        "name", nargs="?", metavar="NAME", help="only this daemon: a device YAML, or its name"
    )
    parser.add_argument("--json", action="store_true", help="print JSON, for programs")
    parser.add_argument(
        "--idle",
        action="store_true",
        help="say whether a restart now would disturb a robot: exit code 0 if no device is in use",
    )
    parser.add_argument("--runtime-dir", metavar="DIR", help="only the daemon of this directory")


def run(args: argparse.Namespace) -> int:
    """Return 0 if all daemons serve, 1 for faults, 2 if a daemon died or is silent, and 3 if this user
    sees no daemon.

    With `--idle`, return 0 if no device is in use, and 4 if a device is in use. A named daemon that
    does not exist is not idle, so the result is 3.
    """
    folders = [Path(args.runtime_dir)] if args.runtime_dir else list(daemon_folders())
    found = list(daemons(folders, {} if args.runtime_dir else units(), time.time()))
    if args.name:
        there = [one.name for one in found if one.state != "stopped" or one.unit]
        name = service_name(args.name)
        found = [one for one in found if one.name == name]
        if there and not found:
            print(f"no daemon {name}; there is {', '.join(there)}", file=sys.stderr)
            if not args.json:
                return NONE
    else:  # leave out stopped daemons that a person started by hand
        found = [one for one in found if one.state != "stopped" or one.unit]
    if args.idle and (found or not (args.name or args.runtime_dir)):
        return _tell_use(found)
    if args.json:
        print(json.dumps([{**msgspec.to_builtins(one), "level": one.level} for one in found]))
    else:
        show(found, sys.stdout)
    return max((one.level for one in found), default=NONE)


def users(one: DaemonStatus) -> Iterator[str]:
    """Yield each reason why a daemon must not be restarted now. The reason is that a device is in use,
    or that nobody knows whether it is in use."""
    if one.state == "stopped":
        return
    if one.state != "serving":
        yield f"{one.name}: it does not serve, so nobody knows whether its devices are in use"
        return
    kind = str(one.status.get("kind"))
    if kind not in IN_USE:
        yield f"{one.name}: nobody knows whether a device of kind {kind} is in use"
    for name, device in one.devices.items():
        for key in IN_USE.get(kind, ()):
            if (value := str(device.get(key, ""))) not in FREE:
                yield f"{one.name}: {printable(name)} is in use ({key} {printable(value)})"


def _tell_use(found: Iterable[DaemonStatus]) -> int:
    told = [line for one in found for line in users(one)]
    print("\n".join(told) or "idle: no device of this machine is in use")
    return BUSY if told else IDLE


def show(found: Iterable[DaemonStatus], out: TextIO) -> None:
    """Print a block of lines for each daemon."""
    blocks = list(found)
    if not blocks:
        why = "" if os.geteuid() == 0 else " that this user may see (try sudo)"
        print(f"no daemon of rmf-bridges is on this machine{why}", file=out)
        return
    known = remedies() if any(_faults(one) for one in blocks) else {}
    for one in blocks:
        print("\n".join(_lines(one, known, out)), file=out)


def _lines(one: DaemonStatus, known: Mapping[str, Remedy], out: TextIO) -> Iterator[str]:
    paint = red if one.level else bold
    simulated = " SIMULATED" if one.status.get("simulated") else ""
    by = f"{one.by}, {one.unit}" if one.unit else one.by
    yield paint(f"{one.name}: {_state(one)}{simulated}", out) + f" ({by})"
    if one.why:
        yield f"  {printable(one.why)}"
    if one.status and one.state in ("serving", "old"):
        yield from _serving(one, known, out)


def _serving(one: DaemonStatus, known: Mapping[str, Remedy], out: TextIO) -> Iterator[str]:
    about = {
        "file": "?",
        "transport": "?",
        "domain_id": "?",
        "kind": "?",
        "version": "?",
        **one.status,
    }
    yield "  {file}: {kind}, version {version}, {transport} domain {domain_id}".format(**about)
    for topic, nodes in one.status.get("heard_by", {}).items():
        yield f"  {topic}: " + ("nobody listens" if not nodes else f"heard by {_nodes(nodes)}")
    for topic, nodes in one.status.get("hears", {}).items():
        yield f"  {topic}: " + ("nobody sends" if not nodes else f"from {_nodes(nodes)}")
    file = str(one.status.get("file", ""))
    yield from _fault_lines(one.status, known, out, file)
    for name, device in one.devices.items():
        yield f"  {printable(name)}: {_told(device)}; {_age(device, one.age_s or 0.0)}"
        yield from _fault_lines(device, known, out, file, name)


def _state(one: DaemonStatus) -> str:
    match one.state:
        case "old":
            age = (
                "has written no status yet"
                if one.age_s is None
                else f"silent for {one.age_s:.0f} s"
            )
            return f"runs, but {age}"
        case "died" if one.status.get("simulated"):
            return "has died"
        case "died":
            file = one.status.get("file") or "FILE"
            return (
                f"has died; its next start, or `rmf-bridge outputs-off {file}`, switches off what it"
                " left on"
            )
        case "left on":
            return "has died, and its outputs were not verified off"
        case "failed":
            return f"does not start; `rmf-bridge log {one.name}` tells why"
        case "unknown":
            return "cannot be seen"
        case "serving" if one.status.get("passive"):
            rivals = one.status.get("other_publishers")
            return "passive" if rivals else "listens before it publishes"
        case other:
            return other


def _told(device: Status) -> str:
    told = (
        (key, f"({plain(value)})" if isinstance(value, Mapping) else value)
        for key, value in device.items()
        if key not in NOT_TOLD
    )
    shown = ", ".join(f"{key} {value}" for key, value in told if value not in ("-", ""))
    return printable(shown) or "nothing to tell"


def _age(device: Status, snapshot_s: float) -> str:
    """Return the time since the device's input was read. The result includes the age of the status
    file, which is up to 1 s."""
    age_s = device.get("input_age_s")
    return "never read" if age_s is None else f"read {age_s + snapshot_s:.1f} s ago"


def _nodes(count: int) -> str:
    return f"{count} node{'s' if count > 1 else ''}"


def _faults(one: DaemonStatus) -> bool:
    return any(part.get("faults") for part in (one.status, *one.devices.values()))


def _fault_lines(
    part: Status, known: Mapping[str, Remedy], out: TextIO, file: str, name: str = ""
) -> Iterator[str]:
    faults = part.get("faults", ())
    settings = values(file, name) if faults and name else {}
    for fault in faults:
        detail = printable(": ".join(filter(None, (fault["code"], fault["detail"]))))
        yield "    " + red(detail, out)
        if fault["code"] in known:
            remedy = here(known[fault["code"]], file, name, settings)
            yield f"      cause: {printable(remedy.cause)}"
            yield f"      do: {printable(remedy.do)}"
