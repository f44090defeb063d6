"""The ring: a file of fixed size on tmpfs that holds the last minutes of a daemon's messages and
decisions. If the daemon is killed, the file stays.

The file has a head, which describes the daemon's run, and then SEGMENTS of equal size. The daemon fills
the segments in turn. Each segment begins with its number and the state of every subject. The entries
follow. Each entry has its length, a checksum and its content.

The checksum also covers the segment's number. So an old entry is not valid after its segment has got a
new number. An entry that a kill has cut short is not valid either.

The daemon writes the file with `pwrite` and does not map it. With a mapped file, somebody could kill
the daemon by truncating the file, because access to a lost page raises a signal.
"""

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final

from bridges.blackbox import entries
from bridges.blackbox.entries import AnyEntry, Head
from bridges.system import user_files

MAGIC: Final = b"RMFRING1"
SEGMENTS: Final = 8
TOP: Final = struct.Struct("<8sBxxxII")
"""The first bytes of the file: magic, flag of a clean shutdown, size of a segment, length of the
head."""
ENDED_AT: Final = 8
MARK: Final = struct.Struct("<QI")
"""The first bytes of a segment: its number, and the checksum of that number."""
FRAME: Final = struct.Struct("<II")
"""The first bytes of an entry: its length and its checksum."""
PAGE: Final = 4096
LARGEST: Final = 72 << 20
LONGEST_TOP: Final = 4 << 20
NAME: Final = "ring"
DIED: Final = "ring.died"


class RingError(Exception):
    """Error for a file that is not a ring, or that cannot be read."""


class Ring:
    """A ring that the daemon writes. After an OSError from a method, the caller must make a new
    ring."""

    def __init__(self, folder: Path, head: Head, size: int) -> None:
        """Make the file and reserve all its space. If an earlier run died, keep the ring of that run
        under the name DIED."""
        self.path = folder / NAME
        self._segment_size = max(size // SEGMENTS, PAGE)
        told = entries.encode(head)
        top = TOP.pack(MAGIC, 0, self._segment_size, len(told))
        top += struct.pack("<I", zlib.crc32(told)) + told
        self._first = -(-len(top) // PAGE) * PAGE
        if _died(self.path):
            os.replace(self.path, folder / DIED)
        new = folder / f".{NAME}.{os.getpid()}"
        flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC
        self._file = os.open(new, flags, 0o640)
        try:
            os.posix_fallocate(self._file, 0, self._first + SEGMENTS * self._segment_size)
            os.pwrite(self._file, top, 0)
            os.replace(new, self.path)
        except OSError:
            os.close(self._file)
            raise
        self._number = 0
        self._offset = self._segment_size

    @property
    def lives(self) -> bool:
        """Return whether the path still leads to the file of this ring."""
        try:
            return os.path.samestat(os.fstat(self._file), self.path.lstat())
        except OSError:
            return False

    @property
    def room(self) -> int:
        """The maximum size (bytes) of one entry."""
        return self._segment_size - MARK.size - 2 * FRAME.size

    def fits(self, length: int) -> bool:
        """Return whether `length` bytes of framed entries fit into the rest of the present segment."""
        return self._offset + length + FRAME.size <= self._segment_size

    def begin_segment(self) -> None:
        """Begin the next segment, and discard the segment's old content."""
        self._number += 1
        number = self._number.to_bytes(8, "little")
        start = MARK.pack(self._number, zlib.crc32(number)) + bytes(FRAME.size)
        os.pwrite(self._file, start, self._place)
        self._offset = MARK.size

    def frame(self, content: bytes) -> bytes:
        """Return an entry with its frame for this segment: length, checksum, content."""
        return FRAME.pack(len(content), zlib.crc32(content, self._number)) + content

    def write(self, frames: bytes) -> None:
        """Append framed entries to the present segment. The entries must fit."""
        os.pwrite(self._file, frames + bytes(FRAME.size), self._place + self._offset)
        self._offset += len(frames)

    def close(self, *, ended: bool) -> None:
        """Close the ring. `ended`: the run shut down cleanly, so the recorder does not keep the
        ring."""
        try:
            if ended:
                os.pwrite(self._file, b"\1", ENDED_AT)
        finally:
            os.close(self._file)

    @property
    def _place(self) -> int:
        return self._first + self._number % SEGMENTS * self._segment_size


def _died(path: Path) -> bool:
    """Return whether the file at the path is a ring of a run that did not shut down cleanly."""
    try:
        found = user_files.read(path, TOP.size - 1).content
    except OSError:
        return False
    return found[: len(MAGIC)] == MAGIC and found[ENDED_AT : ENDED_AT + 1] == b"\0"


class RingContent:
    """The content of a ring at one time. `head` describes the run. `ended`: the run shut down cleanly.

    `segments` maps the number of each segment to its entries, the oldest segment first. It has no
    incomplete entries.
    """

    def __init__(self, path: Path) -> None:
        """Read the ring. Raises RingError."""
        self.head, first, size = _top(path)
        try:
            content = user_files.read(path, LARGEST).content
        except OSError as error:
            raise RingError(f"{path} cannot be read: {error.strerror}") from None
        self.ended = content[ENDED_AT : ENDED_AT + 1] == b"\1"
        starts = {}
        for place in range(first, len(content) - MARK.size, size):
            number, checksum = MARK.unpack_from(content, place)
            if zlib.crc32(number.to_bytes(8, "little")) == checksum and number:
                starts[number] = place
        try:
            self.segments = {
                number: _entries(content[starts[number] : starts[number] + size], number)
                for number in sorted(starts)
            }
        except entries.Invalid as error:
            raise RingError(f"{path} has an entry that is invalid: {error}") from None

    def entries(self) -> Iterator[AnyEntry]:
        """Yield every entry, the oldest first."""
        for found in self.segments.values():
            yield from found


class Tail:
    """A reader that returns new entries while the daemon writes the ring.

    `head` describes the run. The constructor and `new` raise RingError if the file cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.head, self._first, self._size = _top(path)
        self._number = 0
        self._offset = MARK.size

    def new(self) -> list[AnyEntry]:
        """Return the entries since the last call. The first call returns all entries. Entries that the
        daemon has already overwritten are missing."""
        try:
            with self.path.open("rb") as ring:
                return self._new(ring)
        except (OSError, entries.Invalid) as error:
            raise RingError(f"{self.path} cannot be followed: {error}") from None

    def _new(self, ring: IO[bytes]) -> list[AnyEntry]:
        found: list[AnyEntry] = []
        starts = [self._start(ring, turn) for turn in range(SEGMENTS)]
        for number, place in sorted((number, turn) for turn, number in enumerate(starts) if number):
            if number < self._number:
                continue
            if number > self._number:
                self._number, self._offset = number, MARK.size
            ring.seek(self._first + place * self._size + self._offset)
            content = ring.read(self._size - self._offset)
            end = 0
            for entry, end in frames(content, number, 0):  # noqa: B007 - the last one counts
                found.append(entries.decode(entry))
            self._offset += end
        return found

    def _start(self, ring: IO[bytes], turn: int) -> int:
        """Return the number of the segment at the index `turn` of the file. Return 0 if there is no
        valid segment."""
        ring.seek(self._first + turn * self._size)
        start = ring.read(MARK.size)
        if len(start) < MARK.size:
            return 0
        number, checksum = MARK.unpack(start)
        valid = zlib.crc32(number.to_bytes(8, "little")) == checksum
        return number if valid else 0


def _top(path: Path) -> tuple[Head, int, int]:
    """Return a ring's head, the offset of the first segment, and the size of a segment. Raises
    RingError."""
    try:
        content = user_files.read(path, LONGEST_TOP).content
        magic, _, size, length = TOP.unpack_from(content)
        (checksum,) = struct.unpack_from("<I", content, TOP.size)
        told = content[TOP.size + 4 : TOP.size + 4 + length]
        if magic != MAGIC or zlib.crc32(told) != checksum or size < PAGE:
            raise RingError(f"{path} is not a ring of this version")
        return entries.decode_head(told), -(-(TOP.size + 4 + length) // PAGE) * PAGE, size
    except OSError as error:
        raise RingError(f"{path} cannot be read: {error.strerror}") from None
    except (struct.error, entries.Invalid) as error:
        raise RingError(f"{path} cannot be read as a ring: {error}") from None


def _entries(segment: bytes, number: int) -> list[AnyEntry]:
    return [entries.decode(content) for content, _ in frames(segment, number, MARK.size)]


def frames(segment: bytes, number: int, at: int) -> Iterator[tuple[bytes, int]]:
    """Yield each entry of a segment, and the offset at which the entry ends. Begin at offset `at`. Stop
    at the first incomplete entry."""
    while at + FRAME.size <= len(segment):
        length, checksum = FRAME.unpack_from(segment, at)
        content = segment[at + FRAME.size : at + FRAME.size + length]
        if length == 0 or len(content) < length or zlib.crc32(content, number) != checksum:
            return
        at += FRAME.size + length
        yield content, at
