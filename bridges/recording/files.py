"""What can be replayed: a file that our recorder wrote, or a daemon's ring itself."""

from collections.abc import Iterator
from pathlib import Path

from bridges import user_files
from bridges.recording.bags import INSTALL
from bridges.recording.entries import AnyEntry, Head
from bridges.recording.ring import MAGIC, Read, RingError
from bridges.recording.sources import BagError, Notes


def opened(path: Path, notes: Notes) -> tuple[Head, Iterator[AnyEntry]]:
    """The run of a daemon that a file is of, and its entries. Raises BagError."""
    try:
        begins = user_files.read(path, len(MAGIC)).content
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None
    if begins.startswith(MAGIC):
        try:
            ring = Read(path)
        except RingError as error:
            raise BagError(str(error)) from None
        return ring.head, ring.entries()
    try:
        from bridges.recording import incidents
    except ImportError as error:
        raise BagError(f"to read {path}, {error.name} is needed: {INSTALL}") from None
    return incidents.head_of(path), incidents.entries_in(path, notes)
