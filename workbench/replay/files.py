"""Open a recording for a replay. A recording may be our recorder's file, a directory of such files, or
a ring."""

from collections.abc import Iterator
from pathlib import Path

from bridges.blackbox.entries import AnyEntry, Head
from bridges.blackbox.incident import INSTALL
from bridges.blackbox.ring import MAGIC, RingContent, RingError
from bridges.system import user_files
from workbench.replay.bags import continuous
from workbench.replay.sources import BagError, Notes


def opened(path: Path, notes: Notes) -> tuple[Head, Iterator[AnyEntry]]:
    """Return the head of a daemon's run (the time from its start to its end), and the entries of this
    run.

    For a directory, return the first run. The run's entries come from all files, in the order of file
    names. Raises BagError.
    """
    if path.is_dir():
        return _of_all(sorted(path.glob("*.mcap")), path, notes)
    try:
        begins = user_files.read(path, len(MAGIC)).content
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None
    if begins.startswith(MAGIC):
        try:
            ring = RingContent(path)
        except RingError as error:
            raise BagError(str(error)) from None
        return ring.head, ring.entries()
    try:
        from workbench.replay import incidents
    except ImportError as error:
        raise BagError(f"to read {path}, {error.name} is needed: {INSTALL}") from None
    return incidents.head_of(path), incidents.entries_in(path, notes)


def _of_all(files: list[Path], folder: Path, notes: Notes) -> tuple[Head, Iterator[AnyEntry]]:
    """Return the run in the first file, and the entries of this run from all files. If there are
    continuous files, use only those files."""
    if not files:
        raise BagError(f"{folder} holds no recording: it has no .mcap file")
    files = continuous(files)
    head, _ = opened(files[0], notes)
    return head, _in_turn(files, head, notes)


def _in_turn(files: list[Path], head: Head, notes: Notes) -> Iterator[AnyEntry]:
    for file in files:
        found, entries = opened(file, notes)
        if found.file == head.file:
            yield from entries
