"""`rmf-bridge status`: every daemon on this machine, what it tells RMF, its faults and what to do.

It reads the daemons' status files and asks systemd; it opens no bus and joins no graph.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, TextIO, cast

import msgspec

from bridges.host import files
from bridges.host.paint import bold, red
from bridges.host.places import SERVICE_RUN, SERVICE_STATE, Places, owner_of, runtimes, state_base
from bridges.messages.words import printable
from bridges.runtime import holder
from bridges.runtime.faults import Remedy, here, remedies, values
from bridges.runtime.record import paths, read
from bridges.runtime.subject import Status

UNIT: Final = "rmf-bridge@"
RUNS: Final = ("active (running)", "activating (start)", "deactivating (stop-sigterm)")
"""What systemd says of a unit whose process is there."""
ASK_SYSTEMD_S: Final = 3.0
WELL, FAULTY, DOWN, NONE = 0, 1, 2, 3
"""Exit codes, as monitoring plugins have them: OK, WARNING, CRITICAL, UNKNOWN."""
NOT_TOLD: Final = ("contacts", "faults", "input_age_s", "outputs", "refused")
LEVEL_OF: Final = {
    "serving": WELL,
    "old": DOWN,
    "died": DOWN,
    "left on": DOWN,
    "failed": DOWN,
    "unknown": NONE,
    "stopped": WELL,
}


class FaultStatus(msgspec.Struct):
    """A fault in a status file."""

    code: str
    detail: str


class DeviceStatus(msgspec.Struct):
    """What every device's status has; its other keys are the kind's own."""

    faults: list[FaultStatus] = []
    input_age_s: float | None = None


class StatusFile(msgspec.Struct):
    """What `status` relies on in a status file."""

    devices: dict[str, DeviceStatus] = {}
    faults: list[FaultStatus] = []
    heard_by: dict[str, int] = {}
    hears: dict[str, int] = {}


class Daemon(msgspec.Struct, kw_only=True):
    """One daemon, or a unit without one.

    `state`: `serving`; `old`: it writes no status any more; `died` without tidying up; `left on`: it
    died with outputs that nobody has verified off; `failed`: systemd has given up; `stopped`;
    `unknown`: this user may not see it. `unit`: what systemd says.
    """

    name: str
    state: str
    by: str
    unit: str = ""
    why: str = ""
    age_s: float | None = None
    status: dict[str, Any] = {}

    @property
    def devices(self) -> Mapping[str, Status]:
        """Its devices' part of the status file."""
        return cast(Mapping[str, Status], self.status.get("devices", {}))

    @property
    def level(self) -> int:
        """Its exit code."""
        level = LEVEL_OF[self.state]
        parts = (self.status, *self.devices.values())
        return max(level, FAULTY) if any(part.get("faults") for part in parts) else level


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `status`."""
    parser.add_argument(
        "name", nargs="?", metavar="NAME", help="only this one: a device YAML, or its name"
    )
    parser.add_argument("--json", action="store_true", help="for programs")
    parser.add_argument("--runtime-dir", metavar="DIR", help="only the daemon of this directory")


def run(args: argparse.Namespace) -> int:
    """0: all serve; 1: there are faults; 2: one has died or is silent; 3: none is here, or visible."""
    folders = [Path(args.runtime_dir)] if args.runtime_dir else list(runtimes())
    found = list(daemons(folders, {} if args.runtime_dir else units(), time.time()))
    if args.name:
        there = [one.name for one in found if one.state != "stopped" or one.unit]
        found = [one for one in found if one.name == Path(args.name).stem]
        if there and not found:
            print(f"no daemon {Path(args.name).stem}; there is {', '.join(there)}", file=sys.stderr)
            if not args.json:
                return NONE
    else:  # what was started by hand once is no news
        found = [one for one in found if one.state != "stopped" or one.unit]
    if args.json:
        print(json.dumps([{**msgspec.to_builtins(one), "level": one.level} for one in found]))
    else:
        show(found, sys.stdout)
    return max((one.level for one in found), default=NONE)


def daemons(
    folders: Iterable[Path], found_units: Mapping[str, str], wall: float
) -> Iterator[Daemon]:
    """The daemon of each runtime directory, and each of systemd's units without one. `wall`: now."""
    rest = dict(found_units)
    for folder in folders:
        service = folder.parent == SERVICE_RUN
        unit = rest.pop(folder.name, "") if service else ""
        by = "service" if service else f"by hand, {owner_of(folder)}"
        with suppress(NotADirectoryError, FileNotFoundError):
            yield _daemon(folder, by, unit, wall)
    for name, unit in rest.items():
        yield Daemon(name=name, state=_without_directory(unit), by="service", unit=unit)


def _daemon(folder: Path, by: str, unit: str, wall: float) -> Daemon:
    one = Daemon(name=folder.name, state="stopped", by=by, unit=unit)
    try:
        held_by = holder.look(Places(folder, folder))
        status, one.age_s = _read(folder / holder.STATUS, wall)
    except PermissionError as error:
        one.state, one.why = "unknown", str(error)
        return one
    one.status = status
    if unit in RUNS or (held_by is not None and held_by.serves):
        fresh = one.age_s is not None and one.age_s <= holder.FRESH_S
        one.state = "serving" if fresh else "old"
    elif status:
        one.state = "died"
    elif left := _unreleased(folder):
        one.state, one.why = "left on", left
    elif unit.startswith("failed"):
        one.state = "failed"
    return one


def _unreleased(folder: Path) -> str:
    """What to do about outputs of a dead daemon that nobody has verified off; "" without a record."""
    state = SERVICE_STATE if folder.parent == SERVICE_RUN else state_base()
    for path in paths(Places(folder, state / folder.name)):
        if record := read(path):
            return (
                f"do: rmf-bridge outputs-off {record.file}; if that hardware is gone, cut its"
                f" supply and remove {path}"
            )
    return ""


def _without_directory(unit: str) -> str:
    return "failed" if unit.startswith("failed") else "stopped"


def _read(path: Path, wall: float) -> tuple[dict[str, Any], float | None]:
    """The status and its age (s); nothing if there is none, or it cannot be understood."""
    try:
        written_at = path.lstat().st_mtime
        text = files.read(path, holder.STATUS_MAX)
        msgspec.json.decode(text, type=StatusFile)
        found = msgspec.json.decode(text, type=dict[str, Any])
    except PermissionError:
        raise
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return {}, None
    return found, max(0.0, wall - written_at)


def units() -> dict[str, str]:
    """State of each of our units by instance, such as `active (running)`; empty without systemd."""
    if shutil.which("systemctl") is None:
        return {}
    ask = ("systemctl", "list-units", "--all", "--plain", "--output=json", f"{UNIT}*")
    try:
        told = subprocess.run(ask, capture_output=True, timeout=ASK_SYSTEMD_S, check=True).stdout
        found = json.loads(told)
    except (OSError, subprocess.SubprocessError, ValueError):
        return {}
    return {
        one["unit"].removeprefix(UNIT).removesuffix(".service"): f"{one['active']} ({one['sub']})"
        for one in found
    }


def show(found: Iterable[Daemon], out: TextIO) -> None:
    """A block of lines for each daemon."""
    blocks = list(found)
    if not blocks:
        why = "" if os.geteuid() == 0 else " that this user may see (try sudo)"
        print(f"no daemon of rmf-bridges is on this machine{why}", file=out)
        return
    known = remedies() if any(_faults(one) for one in blocks) else {}
    for one in blocks:
        print("\n".join(_lines(one, known, out)), file=out)


def _lines(one: Daemon, known: Mapping[str, Remedy], out: TextIO) -> Iterator[str]:
    paint = red if one.level else bold
    simulated = " SIMULATED" if one.status.get("simulated") else ""
    by = f"{one.by}, {one.unit}" if one.unit else one.by
    yield paint(f"{one.name}: {_state(one)}{simulated}", out) + f" ({by})"
    if one.why:
        yield f"  {printable(one.why)}"
    if one.status and one.state in ("serving", "old"):
        yield from _serving(one, known, out)


def _serving(one: Daemon, known: Mapping[str, Remedy], out: TextIO) -> Iterator[str]:
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


def _state(one: Daemon) -> str:
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
            return f"has died; its next start tidies up, or `rmf-bridge outputs-off {file}`"
        case "left on":
            return "has died, and its outputs were not verified off"
        case "unknown":
            return "cannot be seen"
        case "serving" if one.status.get("passive"):
            rivals = one.status.get("other_publishers")
            return "passive" if rivals else "listens before it publishes"
        case other:
            return other


def _told(device: Status) -> str:
    told = ((key, value) for key, value in device.items() if key not in NOT_TOLD)
    shown = ", ".join(f"{key} {value}" for key, value in told if value not in ("-", ""))
    return printable(shown) or "nothing to tell"


def _age(device: Status, snapshot_s: float) -> str:
    """Counted from now: the status file itself is up to a second old."""
    age_s = device.get("input_age_s")
    return "never read" if age_s is None else f"read {age_s + snapshot_s:.1f} s ago"


def _nodes(count: int) -> str:
    return f"{count} node{'s' if count > 1 else ''}"


def _faults(one: Daemon) -> bool:
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
