"""The store of recordings: their names, and limits that spare an SD card."""

import os
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Final

from bridges.blackbox.entries import Head
from bridges.blackbox.incident import Incident

LEAST_FREE: Final = 100_000_000
"""No recording is written to a disk with less room than this (bytes)."""
SUFFIX: Final = ".mcap"


class DiskFull(OSError):
    """The disk has too little room for a recording."""


class Recordings:
    """The recordings of all daemons of a machine, in one directory."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def tidy(self) -> None:
        """Remove the unfinished files of a recorder that died."""
        for begun in self.folder.glob(f".*{SUFFIX}.part"):
            with suppress(OSError):
                begun.unlink()

    def name(self, head: Head, wall: float, code: str) -> str:
        """Return `<file>_<day>_<time>_<why>_<run>.mcap`, in the machine's own time."""
        when = datetime.fromtimestamp(wall).strftime("%Y-%m-%d_%H-%M-%S")
        return f"{_stem(head)}_{when}_{code.lower()}_{head.run[:8]}{SUFFIX}"

    def has(self, head: Head, code: str) -> bool:
        """Is there a recording of this run and for this reason already?"""
        return any(self.folder.glob(f"*_{code.lower()}_{head.run[:8]}{SUFFIX}"))

    def put(self, incident: Incident, wall: float, code: str) -> Path:
        """Write a recording, and remove the same daemon's oldest beyond its limits. Raises OSError."""
        from bridges.blackbox import mcap_write

        self.folder.mkdir(mode=0o750, parents=True, exist_ok=True)
        self._require_room()
        path = self.folder / self.name(incident.head, wall, code)
        mcap_write.write(path, incident)
        self._prune(incident.head, path)
        return path

    def _require_room(self) -> None:
        disk = os.statvfs(self.folder)
        if disk.f_bavail * disk.f_frsize < LEAST_FREE:
            raise DiskFull(f"less than {LEAST_FREE // 1_000_000} MB are free on {self.folder}")

    def _prune(self, head: Head, newest: Path) -> None:
        """Remove a daemon's oldest recordings beyond its limits, but never the newest."""
        keep = head.recording
        of_daemon = [p for p in self.folder.glob(f"{_stem(head)}_*{SUFFIX}") if _is_of(p, head)]
        sized = sorted((p.stat().st_mtime_ns, p.stat().st_size, p) for p in of_daemon)
        files, size = len(sized), sum(bytes_ for _, bytes_, _ in sized)
        for _, bytes_, path in sized:
            if files <= keep.files and size <= keep.files_mb * 1e6:
                return
            if path != newest:
                path.unlink(missing_ok=True)
                files, size = files - 1, size - bytes_


def _stem(head: Head) -> str:
    return Path(head.file).stem


def _is_of(path: Path, head: Head) -> bool:
    """Is this a file of that daemon? A file of `door_1` is not one of `door`."""
    return path.stem.rsplit("_", 4)[0] == _stem(head)


CONTINUOUS: Final = "all"
"""The word in the names of `keep: continuous` files; other files have their cause there."""
