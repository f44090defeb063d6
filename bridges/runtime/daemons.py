"""The daemons on this machine, with their status files. The daemons are found by their runtime
directories and by their systemd units."""

import json
import shutil
import subprocess
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, cast

import msgspec

from bridges.messages.words import printable
from bridges.runtime import holder
from bridges.runtime.diagnostics import CERTIFICATE_FILES
from bridges.runtime.holder import LockHolder
from bridges.runtime.record import PATTERN, Records
from bridges.runtime.subject import Status
from bridges.system import directories, files
from bridges.system.directories import (
    SERVICE_RUN,
    SERVICE_STATE,
    Directories,
    owner_of,
    state_base_of,
)

UNIT: Final = "rmf-bridge@"

NamedCertificate = tuple[str, str, str]
"""A certificate: the daemon that uses it, the key of the YAML that names it, and its file."""

RUNS: Final = ("active (running)", "activating (start)", "deactivating (stop-sigterm)")
"""The states of a systemd unit whose process runs."""
FAILS: Final = ("failed", "activating (auto-restart")
"""The beginnings of the states of a unit whose process has ended by itself. Our units start again for
ever, except after an invalid file."""

ASK_SYSTEMD_S: Final = 3.0

WELL, FAULTY, DOWN, NONE = 0, 1, 2, 3
"""The exit codes of a monitoring plugin: OK, WARNING, CRITICAL, UNKNOWN."""

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
    """The keys that the status of every device has. Each kind of device adds further keys."""

    faults: list[FaultStatus] = []
    input_age_s: float | None = None


class StatusFile(msgspec.Struct):
    """The keys of a status file that `rmf-bridge status` reads."""

    devices: dict[str, DeviceStatus] = {}
    faults: list[FaultStatus] = []
    certificate_files: dict[str, str] = {}
    heard_by: dict[str, int] = {}
    hears: dict[str, int] = {}


class DaemonStatus(msgspec.Struct, kw_only=True):
    """One daemon, or a systemd unit whose daemon does not run. `unit`: the unit's state in systemd.

    The values of `state`:

    - `serving`: The daemon runs and writes its status.
    - `old`: The daemon runs, but its status is not fresh.
    - `died`: The daemon has died, because it has left its status file.
    - `left on`: The daemon has died, and its outputs are not verified off.
    - `failed`: The daemon does not start. systemd tries again, or has given up.
    - `stopped`: The daemon does not run.
    - `unknown`: This user has no permission to read the daemon's files.
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
        """The devices' statuses in the status file."""
        return cast(Mapping[str, Status], self.status.get("devices", {}))

    @property
    def certificates(self) -> list[NamedCertificate]:
        """The certificates that the daemon uses."""
        named = self.status.get(CERTIFICATE_FILES, {}).items()
        return [(printable(self.name), key, file) for key, file in named]

    @property
    def level(self) -> int:
        """Return the exit code with which a monitoring plugin reports this daemon."""
        level = LEVEL_OF[self.state]
        parts = (self.status, *self.devices.values())
        return max(level, FAULTY) if any(part.get("faults") for part in parts) else level


def daemons(
    folders: Iterable[Path], found_units: Mapping[str, str], wall: float
) -> Iterator[DaemonStatus]:
    """Yield the daemon of each runtime directory, and then the systemd units without such a directory.
    `wall`: the present time."""
    rest = dict(found_units)
    for folder in folders:
        service = folder.parent == SERVICE_RUN
        unit = rest.pop(folder.name, "") if service else ""
        by = "service" if service else f"by hand, {owner_of(folder)}"
        with suppress(NotADirectoryError, FileNotFoundError):
            yield _daemon(folder, by, unit, wall)
    for name, unit in rest.items():
        yield DaemonStatus(name=name, state=_without_directory(unit), by="service", unit=unit)


def folders() -> Iterator[Path]:
    """Yield the runtime directories of the daemons that this user sees. Yield also the missing runtime
    directory of each service that left a record: systemd removes the directory at the service's end,
    although its outputs may be on."""
    found = list(directories.runtimes())
    yield from found
    with suppress(OSError):
        left = {SERVICE_RUN / path.parent.name for path in SERVICE_STATE.glob(f"*/{PATTERN}")}
        yield from sorted(left.difference(found))


def persons_daemons(files: Container[str]) -> Iterator[tuple[Path, LockHolder]]:
    """Yield the living daemons that this user sees and that a person started by hand for one of these
    files. `files`: canonical paths. Yield each daemon with its runtime directory. Leave out
    simulations, which use no hardware."""
    for folder in directories.runtimes():
        if folder.parent == SERVICE_RUN:
            continue
        with suppress(PermissionError):
            found = holder.look(Directories(folder, folder))
            if found is None or not found.serves or found.file not in files:
                continue
            if not _read(folder / holder.STATUS, 0.0)[0].get("simulated"):
                yield folder, found


def _daemon(folder: Path, by: str, unit: str, wall: float) -> DaemonStatus:
    one = DaemonStatus(name=folder.name, state="stopped", by=by, unit=unit)
    try:
        held_by = holder.look(Directories(folder, folder))
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
    elif unit.startswith(FAILS):
        one.state = "failed"
    return one


def _unreleased(folder: Path) -> str:
    """Return an instruction for the case that a dead daemon has left outputs on. Return "" if the
    daemon left no record."""
    state = SERVICE_STATE if folder.parent == SERVICE_RUN else state_base_of(folder)
    for path, record in Records(Directories(folder, state / folder.name)).left_on().items():
        return (
            f"do: rmf-bridge outputs-off {record.file}; if the device will not answer"
            f" again, cut its relays' supply and remove {path}"
        )
    return ""


def _without_directory(unit: str) -> str:
    return "failed" if unit.startswith(FAILS) else "stopped"


def _read(path: Path, wall: float) -> tuple[dict[str, Any], float | None]:
    """Return the status and its age (s). Return an empty status and None if the file is missing or
    invalid."""
    try:
        written_at = path.lstat().st_mtime
        text = files.read(path, holder.STATUS_MAX)
        msgspec.json.decode(text, type=StatusFile)
        found = msgspec.json.decode(text, type=dict[str, Any])
    except PermissionError:
        raise
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return {}, None
    return found, abs(wall - written_at)  # a status from the future is not fresh either


def units() -> dict[str, str]:
    """Return the state of each of our systemd units, such as `active (running)`. The key is the unit's
    instance name. Return {} on a machine without systemd."""
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
