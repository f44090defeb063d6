"""Read RMF's messages from a recording: our own file, a file of any release of rosbag2 (MCAP or
sqlite3), or a daemon's ring.

This module reads a recording as a stream, in limited memory. Topics and types outside RMF are skipped
and counted. If a recording is damaged, the messages before the damage come first. Then the damage is
written into `notes`.

In our own files, `log_time` is from a clock that never steps, and `publish_time` is from the wall
clock. Other recordings have only one clock. If that clock steps back, `at` goes on from the value that
it had before the step.
"""

import logging
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from bridges.blackbox.entries import Spoken
from bridges.blackbox.incident import INSTALL, timed
from bridges.blackbox.recordings import CONTINUOUS
from bridges.blackbox.ring import MAGIC, RingContent, RingError
from bridges.messages import cdr
from bridges.messages.heard import Heard, Own, Sender, bounded
from bridges.messages.words import LONGEST_NAME
from bridges.system import user_files
from bridges.system.log import pairs
from workbench.replay.sources import BagError, Notes, Raw, releases, source

__all__ = ["BagError", "Keep", "Notes", "all_in", "heard_in"]

log = logging.getLogger(__name__)

NS: Final = 1e-9
STEPPED_NS: Final = 10**9
"""Minimum step back (ns) in recorded times that counts as a clock set back. A smaller step only means
that the recording is out of order."""
LONGEST_MESSAGE: Final = 8 << 20


Keep = Callable[[str, bytes, float], bool]
"""A function that tells whether to decode a sample. The arguments are the topic, the sample, and the
time of recording (s)."""


def heard_in(path: Path, notes: Notes | None = None, keep: Keep | None = None) -> Iterator[Heard]:
    """Yield all messages of RMF in a recording. The arguments are the same as those of `all_in`."""
    return (one for one in all_in(path, notes, keep) if isinstance(one, Heard))


def all_in(
    path: Path, notes: Notes | None = None, keep: Keep | None = None
) -> Iterator[Heard | Own]:
    """Yield RMF's messages and our recorder's texts, in the order of recording.

    `path` is an MCAP file, a `.db3` file, a directory of rosbag2, or a ring. `notes` gets the numbers
    of skipped messages, and the damage. Without `notes`, the damage is logged. Samples that `keep`
    refuses stay undecoded, which saves nine tenths of the time. Raises BagError if `path` is no
    recording.
    """
    noted = Notes() if notes is None else notes
    clock = _Clock()
    for raw in _raw(path, noted):
        if keep is not None and not keep(raw.topic, raw.sample, raw.at * NS):
            continue
        try:
            if len(raw.sample) > LONGEST_MESSAGE:
                raise cdr.CdrError("too long")
            at, wall = clock.at(raw.at) * NS, raw.wall * NS
            if raw.decode is None:
                yield Own(at, wall, raw.topic, cdr.decode_text(raw.sample))
            else:
                yield Heard(at, wall, raw.topic, bounded(raw.decode(raw.sample)), raw.sender)
        except cdr.CdrError:
            noted.skipped[f"{raw.topic}: cannot be decoded"] += 1
    if noted.damage and notes is None:
        log.warning(pairs("damaged", reason=noted.damage))


class _Clock:
    """A clock that never runs backwards (ns)."""

    def __init__(self) -> None:
        self._shift = 0
        self._last = -(1 << 63)

    def at(self, recorded: int) -> int:
        """Return the steady time of a message recorded at this time."""
        if recorded + self._shift < self._last - STEPPED_NS:
            self._shift = self._last - recorded
        self._last = max(self._last, recorded + self._shift)
        return self._last


def _raw(path: Path, noted: Notes) -> Iterator[Raw]:
    for part in _parts(path):
        yield from _raw_of(part, noted)


def _parts(path: Path) -> list[Path]:
    """Return the files of a recording in order. If a library reads the recording as a whole, return the
    directory."""
    try:
        if not path.is_dir():
            return [path]
        files = sorted(path.iterdir(), key=_number)
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None
    if bags := [file for file in files if file.suffix == ".mcap"]:
        return continuous(bags)
    if any(file.suffix == ".zstd" for file in files):
        raise BagError(f"{path} is compressed as whole files: unpack them with zstd -d")
    databases = [file for file in files if file.suffix == ".db3"]
    if not databases:
        raise BagError(f"{path} holds no recording: it has no .mcap or .db3 file")
    return [path] if (path / "metadata.yaml").exists() else databases


def continuous(files: list[Path]) -> list[Path]:
    """Return our recorder's continuous files. Each of them begins where the one before ends. If there
    are no such files, return all files."""
    return [file for file in files if f"_{CONTINUOUS}_" in file.name] or files


def _number(path: Path) -> tuple[int, str]:
    """Return the number that rosbag2 gives a file. With numbers, name_2 comes before name_10."""
    number = path.stem.rpartition("_")[2]
    return int(number) if number.isdecimal() and len(number) < 7 else 0, path.name


def _raw_of(part: Path, noted: Notes) -> Iterator[Raw]:
    if not part.is_dir() and _beginning(part).startswith(MAGIC):
        return _of_ring(part)
    begins = b"SQLite format 3\0" if part.is_dir() else _beginning(part)
    try:
        if begins.startswith(b"\x89MCAP0"):
            from workbench.replay import mcap_bags

            return mcap_bags.raw_in(part, noted)
        if begins.startswith(b"SQLite format 3\0"):
            from workbench.replay import sqlite_bags

            return sqlite_bags.raw_in(part, noted)
    except ImportError as error:
        raise BagError(f"to read {part}, {error.name} is needed: {INSTALL}") from None
    raise BagError(f"{part} is not a recording: neither MCAP nor a .db3 file of rosbag2")


def _of_ring(path: Path) -> Iterator[Raw]:
    try:
        entries = list(RingContent(path).entries())
    except RingError as error:
        raise BagError(str(error)) from None
    senders: dict[tuple[bool, str], Sender] = {}
    for entry, steady, wall in timed(entries):
        if isinstance(entry, Spoken):
            found = source(entry.topic, entry.type, releases(entry.type, ""))
            if found.decode is not None:
                at, told = round(steady / NS), round(wall / NS)
                new = Sender(entry.node[:LONGEST_NAME]) if entry.node else None
                sender = new and senders.setdefault((entry.sent, new.node), new)
                yield Raw(at, told, found.topic, entry.cdr, found.decode, sender)


def _beginning(path: Path) -> bytes:
    """Read the first bytes. Raises BagError if the file cannot be read, or is no regular file."""
    try:
        return user_files.read(path, 15).content
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None
