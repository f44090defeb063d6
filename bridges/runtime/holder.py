"""Who has a daemon's directory: the process that `holder.json` names, while it is that process.

A look takes no lock, so it hinders nobody; and it permits nothing. Only the lock does
(`runtime_directory.py`).
"""

import os
import time
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from bridges.host.directories import Directories, Distrusted, cannot_be_seen, named, opened
from bridges.host.files import read

HOLDER: Final = "holder.json"
STATUS: Final = "status.json"
FRESH_S: Final = 5.0
"""The status file is written each second."""
LONGEST: Final = 65536
STATUS_MAX: Final = 4 << 20
BOOT: Final = Path("/proc/sys/kernel/random/boot_id")


class LockHolder(msgspec.Struct, frozen=True):
    """A process, the YAML's path, and whether it serves that as a daemon.

    `boot`, `started`: of which boot its number is, and when in it the process began (ticks); 0 if that
    is not known. So a number that somebody else has by now names nobody.
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
        """Whether that process is still there. Of others' processes /proc may not tell the start."""
        if self.boot != _boot() or not _is_there(self.pid):
            return False
        return _started(self.pid) in (self.started, 0)


class _Shown(msgspec.Struct):
    """What a status file says of its daemon."""

    pid: int = 0
    file: str = ""


def ourselves(file: Path, *, serves: bool) -> LockHolder:
    """This process."""
    return LockHolder(os.getpid(), named(file), serves, _boot(), _started(os.getpid()))


def look(places: Directories) -> LockHolder | None:
    """The process that has these directories; None if none lives. Raises PermissionError.

    On a read-only root the state directory keeps an old name: the runtime directory's comes first.
    """
    found = (written(folder) for folder in reversed(places.folders))
    return next((one for one in found if one and one.lives), None) or shown(places)


def written(folder: Path) -> LockHolder | None:
    """The last holder that a directory names, living or not. Raises PermissionError."""
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
    """The living daemon of a fresh status file: one that could not write its name, or whose version
    wrote none."""
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
    """When a process began (ticks since boot); 0 if this user cannot see it, -1 if it is a zombie."""
    try:
        told = Path(f"/proc/{pid}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
    except OSError:
        return 0
    return -1 if told[0] == "Z" else int(told[19])


def _boot() -> str:
    with suppress(OSError):
        return BOOT.read_text().strip()
    return ""
