"""The holder of a daemon's directory. The holder is the living process that `holder.json` names.

A process may look for the holder without a lock, because reading `holder.json` disturbs nobody. But
only the process that has the lock may use the directory (`runtime_directory.py`).
"""

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from bridges.system.directories import Directories, Distrusted, cannot_be_seen, named, opened
from bridges.system.files import read

HOLDER: Final = "holder.json"
STATUS: Final = "status.json"
FRESH_S: Final = 5.0
"""The maximum age (s) of a fresh status file. A daemon writes the file each second."""
LONGEST: Final = 65536
STATUS_MAX: Final = 4 << 20
BOOT: Final = Path("/proc/sys/kernel/random/boot_id")


class LockHolder(msgspec.Struct, frozen=True):
    """A process and the path of its YAML. `serves`: the process is a daemon that serves this YAML.

    `boot`: the id of the boot in which `pid` is valid. `started`: the start of the process in ticks
    since boot, or 0 if unknown. `boot` and `started` show whether another process has the `pid` now.
    """

    pid: int
    file: str
    serves: bool
    boot: str = ""
    started: int = 0

    def __str__(self) -> str:
        return f"process {self.pid}, for {self.file}"

    @property
    def lives(self) -> bool:
        """Return whether the process is alive. If a process has the same pid but another start time, it
        is another process.

        /proc may hide the start time from another user. In that case only `boot` and `pid` are
        compared.
        """
        if self.boot != _boot() or not _is_there(self.pid):
            return False
        return _started(self.pid) in (self.started, 0)


class _Shown(msgspec.Struct):
    """The daemon's process according to a status file. An older version does not write `boot` and
    `started`."""

    pid: int = 0
    file: str = ""
    boot: str = ""
    started: int = 0


def ourselves(file: Path, *, serves: bool) -> LockHolder:
    """Return this process as a holder."""
    return LockHolder(os.getpid(), named(file), serves, _boot(), _started(os.getpid()))


def look(places: Directories) -> LockHolder | None:
    """Return the living holder of these directories. Return None if there is no holder. Raises
    PermissionError.

    The runtime directory comes first. On a read-only root the state directory cannot be updated, so it
    may name an old holder.
    """
    found = (written(folder) for folder in reversed(places.folders))
    return next((one for one in found if one and one.lives), None) or shown(places)


def written(folder: Path) -> LockHolder | None:
    """Return the last holder that a directory names, alive or dead. Raises PermissionError."""
    try:
        with opened(folder):
            return msgspec.json.decode(read(folder / HOLDER, LONGEST), type=LockHolder)
    except (FileNotFoundError, NotADirectoryError, msgspec.MsgspecError, UnicodeDecodeError):
        return None
    except Distrusted:
        raise
    except OSError as error:
        raise cannot_be_seen(folder, error) from None


def shown(places: Directories) -> LockHolder | None:
    """Return the living daemon that a fresh status file names, or None. This process does not count,
    because a dead daemon may have had its pid, as in a container that starts again.

    This also finds a daemon without a `holder.json`. Such a daemon could not write that file, or has an
    older version.
    """
    path = places.runtime / STATUS
    with suppress(OSError, msgspec.MsgspecError, UnicodeDecodeError), opened(places.runtime):
        fresh = abs(time.time() - path.lstat().st_mtime) < FRESH_S
        found = msgspec.json.decode(read(path, STATUS_MAX), type=_Shown)
        one = LockHolder(found.pid, found.file, True, found.boot, found.started)
        lives = one.lives if one.started else _is_there(one.pid)
        if fresh and lives and one.pid != os.getpid():
            return one
    return None


def _is_there(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except PermissionError:
        return pid > 0
    except (ProcessLookupError, OverflowError):
        return False
    return pid > 0 and _started(pid) >= 0


def _started(pid: int) -> int:
    """Return a process's start in ticks since boot. Return 0 if this user has no permission to read it,
    and -1 for a zombie."""
    try:
        told = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
    except OSError:
        return 0
    return -1 if told[0] == "Z" else int(told[19])


def _boot() -> str:
    with suppress(OSError):
        return BOOT.read_text().strip()
    return ""
