"""The store of recordings: the names of the files, and the limits on their number and size. The limits
keep the SD card from wearing out.

All daemons of a machine share one store and one limit. Above the limit, files are removed in this
order:

1. files of `keep: continuous`
2. later recordings of the same fault
3. later recordings of a death (a run without a clean shutdown)
4. the first file of each cause
5. the first death of each daemon

Within a group the oldest file is removed first. The time in a file's name tells its age. If a file's
name has another form, a person has named the file. Such a file is never counted or removed.
"""

import os
import re
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Final, NamedTuple

from bridges.blackbox.entries import Head
from bridges.blackbox.incident import Incident
from bridges.kinds.shared.recording_section import RecordingSettings

LEAST_FREE: Final = 100_000_000
"""The free space (bytes) that a disk must have. With less free space, no recording is written."""
SUFFIX: Final = ".mcap"
CONTINUOUS: Final = "all"
"""The word in the names of `keep: continuous` files. In other names the cause stands in its place."""
DEATH: Final = "died"
_NAME: Final = re.compile(r"(.+)_(\d+-\d+-\d+_\d+-\d+-\d+)_([^_]+)_[^_]+")
_TIME: Final = "%Y-%m-%d_%H-%M-%S"


class DiskFull(OSError):
    """Error for a disk that has too little room for a recording."""


class Named(NamedTuple):
    """The parts of a recording's name. `at`: the time (s since the epoch). `daemon`: the name of the
    YAML. `why`: the reason."""

    at: float
    daemon: str
    why: str

    @property
    def cause(self) -> tuple[str, str]:
        """Return the daemon and the reason. A later file with the same daemon and reason is a
        repeat."""
        return self.daemon, self.why


class Stored(NamedTuple):
    """A recording in the store. `size`: bytes."""

    path: Path
    name: Named
    size: int


class Recordings:
    """The recordings of all daemons of a machine, in one directory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def tidy(self) -> None:
        """Remove the unfinished files of a recorder that died."""
        for begun in self.folder.glob(f".*{SUFFIX}.part"):
            with suppress(OSError):
                begun.unlink()

    def name(self, head: Head, wall: float, why: str) -> str:
        """Return `<file>_<day>_<time>_<why>_<run>.mcap`. Day and time are in the machine's time
        zone."""
        when = datetime.fromtimestamp(wall).strftime(_TIME)
        return f"{Path(head.file).stem}_{when}_{why}_{head.run[:8]}{SUFFIX}"

    def has_death(self, head: Head) -> bool:
        """Return whether a recording already exists of this run's death (no clean shutdown)."""
        return any(self.folder.glob(f"*_{DEATH}_{head.run[:8]}{SUFFIX}"))

    def put(
        self, incident: Incident, wall: float, why: str, others: Iterable[RecordingSettings] = ()
    ) -> Path:
        """Write a recording, and then remove files until the store is within its limit.

        The limit is the largest limit in the settings of this daemon and in `others`. Raises OSError.
        """
        from bridges.blackbox import mcap_write

        self.folder.mkdir(mode=0o750, parents=True, exist_ok=True)
        self._require_room()
        path = self.folder / self.name(incident.head, wall, why)
        mcap_write.write(path, incident)
        settings = (incident.head.recording, *others)
        self._prune(path, max(s.files for s in settings), max(s.files_mb for s in settings) * 1e6)
        return path

    def _require_room(self) -> None:
        disk = os.statvfs(self.folder)
        if disk.f_bavail * disk.f_frsize < LEAST_FREE:
            raise DiskFull(f"less than {LEAST_FREE // 1_000_000} MB are free on {self.folder}")

    def _prune(self, newest: Path, most_files: int, most_bytes: float) -> None:
        """Remove files until the store is within both limits. Never remove the newest file."""
        stored = [
            Stored(path, found, path.stat().st_size)
            for path in self.folder.glob(f"*{SUFFIX}")
            if (found := named(path))
        ]
        files, size = len(stored), sum(one.size for one in stored)
        for one in least_valuable_first(stored, time.time()):
            if files <= most_files and size <= most_bytes:
                return
            if one.path != newest:
                one.path.unlink(missing_ok=True)
                files, size = files - 1, size - one.size


def least_valuable_first(stored: Sequence[Stored], now: float) -> list[Stored]:
    """Return the files in the order of their removal. `now`: seconds since the epoch.

    A file with a future time was written before somebody set the clock back. So that file counts as the
    oldest.
    """
    by_age = sorted(stored, key=lambda one: (one.name.at <= now, one.name.at))
    first = {one.name.cause: one for one in reversed(by_age)}

    def value(one: Stored) -> tuple[bool, bool, bool]:
        if one.name.why == CONTINUOUS:
            return False, False, False
        return True, first[one.name.cause] is one, one.name.why == DEATH

    return sorted(by_age, key=value)


def reason(code: str, text: str = "") -> str:
    """Return the part of a file's name that gives a note's reason, such as `fault-lift-door-stuck`."""
    cause = text.partition(":")[0] if code in ("FAULT", "REFUSED") else ""
    return re.sub(r"[^a-z0-9]+", "-", f"{code} {cause}".lower()).strip("-")[:60]


def named(path: Path) -> Named | None:
    """Return the parts of a file's name. Return None for a file that a person has named."""
    parts = _NAME.fullmatch(path.stem)
    with suppress(ValueError, OverflowError):
        if parts:
            at = datetime.strptime(parts[2], _TIME).timestamp()
            return Named(at, parts[1], parts[3])
    return None
