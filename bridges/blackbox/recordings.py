"""The store of recordings: the names of the files, and the limits that spare an SD card.

All daemons of a machine share one store and one bound. Files are removed in this order: files of `keep:
continuous`, repeats of a fault, repeated deaths, the first file of each cause, and last the first death
of a daemon. Among equals the oldest file goes first, by the time in its name. A file with another form
of name is a person's: it is neither counted nor removed.
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
"""The least free room (bytes) on a disk. If there is less, no recording is written."""
SUFFIX: Final = ".mcap"
CONTINUOUS: Final = "all"
"""The word in the names of `keep: continuous` files. Other files have their cause at that place."""
DEATH: Final = "died"
_NAME: Final = re.compile(r"(.+)_(\d+-\d+-\d+_\d+-\d+-\d+)_([^_]+)_[^_]+")
_TIME: Final = "%Y-%m-%d_%H-%M-%S"


class DiskFull(OSError):
    """The disk has too little room for a recording."""


class Named(NamedTuple):
    """The parts of a file's name: its time (s since the epoch), the daemon's YAML, and the reason."""

    at: float
    daemon: str
    why: str

    @property
    def cause(self) -> tuple[str, str]:
        """Return daemon and reason. A file with the same daemon and reason as an earlier file is a
        repeat."""
        return self.daemon, self.why


class Stored(NamedTuple):
    """A file of the store. `size`: bytes."""

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
        """Return whether a recording of this run's death already exists."""
        return any(self.folder.glob(f"*_{DEATH}_{head.run[:8]}{SUFFIX}"))

    def put(
        self, incident: Incident, wall: float, why: str, others: Iterable[RecordingSettings] = ()
    ) -> Path:
        """Write a recording. If the store then exceeds the machine's bound, remove files of little
        value. The bound is the largest bound of this daemon and of the `others`. Raises OSError."""
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
        """Remove files until these limits hold, but never the newest file."""
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
    """Return the files in the order of their removal. `now`: s since the epoch. A file from the future
    was written before the clock was set back, so it counts as the oldest."""
    by_age = sorted(stored, key=lambda one: (one.name.at <= now, one.name.at))
    first = {one.name.cause: one for one in reversed(by_age)}

    def value(one: Stored) -> tuple[bool, bool, bool]:
        if one.name.why == CONTINUOUS:
            return False, False, False
        return True, first[one.name.cause] is one, one.name.why == DEATH

    return sorted(by_age, key=value)


def reason(code: str, text: str = "") -> str:
    """Return a note's reason in the form for a file's name, such as `fault-lift-door-stuck`."""
    cause = text.partition(":")[0] if code in ("FAULT", "REFUSED") else ""
    return re.sub(r"[^a-z0-9]+", "-", f"{code} {cause}".lower()).strip("-")[:60]


def named(path: Path) -> Named | None:
    """Return the parts of a file's name; None for a file that a person has named."""
    parts = _NAME.fullmatch(path.stem)
    with suppress(ValueError, OverflowError):
        if parts:
            at = datetime.strptime(parts[2], _TIME).timestamp()
            return Named(at, parts[1], parts[3])
    return None
