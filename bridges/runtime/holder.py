"""The holder of a daemon's directory: the process that `holder.json` names, if that process lives.

Looking for the holder takes no lock and hinders no process, but gives no right to the directory. Only
the lock gives that right (`runtime_directory.py`).
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
"""The age (s) up to which a status file is fresh. The file is written each second."""
LONGEST: Final = 65536
STATUS_MAX: Final = 4 << 20
BOOT: Final = Path("/proc/sys/kernel/random/boot_id")


class LockHolder(msgspec.Struct, frozen=True):
    """A process and the path of its YAML. `serves`: the process is a daemon that serves this YAML.

    `boot`: the id of the boot in which `pid` is valid. `started`: the start of the process, in ticks
    since boot, 0 if unknown. Both show whether the kernel has given `pid` to another process since.
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
        """Return whether the process is still alive. A process with another start time is another
        process. If /proc hides the start time, because the process belongs to another user, it is
        not compared."""
        if self.boot != _boot() or not _is_there(self.pid):
            return False
        return _started(self.pid) in (self.started, 0)


class _Shown(msgspec.Struct):
    """The daemon's process in a status file."""

    pid: int = 0
    file: str = ""


def ourselves(file: Path, *, serves: bool) -> LockHolder:
    """Return this process as a holder."""
    return LockHolder(os.getpid(), named(file), serves, _boot(), _started(os.getpid()))


def look(places: Directories) -> LockHolder | None:
    """Return the living holder of these directories, or None if there is none. Raises PermissionError.

    The runtime directory comes first. On a read-only root the state directory names an old holder.
    """
    found = (written(folder) for folder in reversed(places.folders))
    return next((one for one in found if one and one.lives), None) or shown(places)


def written(folder: Path) -> LockHolder | None:
    """Return the last holder that a directory names, living or not. Raises PermissionError."""
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
    """Return the living daemon that a fresh status file names, or None. This finds a daemon without a
    `holder.json`: it could not write the file, or is of an older version."""
    path = places.runtime / STATUS
    with suppress(OSError, msgspec.MsgspecError, UnicodeDecodeError), opened(places.runtime):
        fresh = abs(time.time() - path.lstat().st_mtime) < FRESH_S
        found = msgspec.json.decode(read(path, STATUS_MAX), type=_Shown)
        if fresh and _is_there(found.pid):
            return LockHolder(found.pid, found.file, True)
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
    """Return a process's start (ticks since boot). Return 0 if this user may not see it, and -1 for a
    zombie."""
    try:
        told = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
    except OSError:
        return 0
    return -1 if told[0] == "Z" else int(told[19])


def _boot() -> str:
    with suppress(OSError):
        return BOOT.read_text().strip()
    return ""
