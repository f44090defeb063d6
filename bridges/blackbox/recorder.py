"""The recorder: one process that makes recordings (files) of all daemons of a machine from their rings.

A ring is a file in memory that holds a daemon's last minutes. The recorder has no devices, and no
daemon waits for it. Each second it reads the new entries of each ring. An entry may trigger a recording
(`triggers.py`). The recorder then waits for the entries of the next AFTER_S seconds, and writes a file.

Without a trigger the recorder writes nothing, except for a daemon whose YAML has `keep: continuous`.
"""

import logging
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Final

from bridges.blackbox import days
from bridges.blackbox.entries import AnyEntry, Clocks, Head, Known
from bridges.blackbox.incident import AFTER_S, BEFORE_S, Incident, Note, of_end, part
from bridges.blackbox.recordings import CONTINUOUS, DEATH, Recordings, reason
from bridges.blackbox.ring import DIED as DIED_NAME
from bridges.blackbox.ring import NAME, RingContent, RingError, Tail
from bridges.blackbox.triggers import AGAIN_S, Triggers, death
from bridges.kinds.shared.durations import AGES_AGO
from bridges.observe.all_devices import Key
from bridges.observe.tally import DeviceCounts
from bridges.system.log import pairs

log = logging.getLogger(__name__)

LATE_S: Final = 60.0
"""The maximum age (s) of a trigger when the recorder opens a ring. Older triggers cause no recording,
because an earlier run of the recorder has recorded them."""
GRACE_S: Final = 2.0
"""The time (s) for which the recorder waits after the last instant of a recording. By then the ring has
every entry of the recording."""
COUNTED_S: Final = 3600.0
"""The interval (s) at which the day's counts are written. The interval is long because each write wears
the SD card."""
PART_S: Final = 300.0
"""The length (s) of one file for `keep: continuous`."""


class Recorder:
    """The reader of all daemons' rings, which writes the recordings.

    `folders` returns the daemons' runtime directories. `now` returns the machine's time (s), and
    `today` the present day.
    """

    def __init__(
        self,
        folders: Callable[[], Iterable[Path]],
        recordings: Recordings,
        now: Callable[[], float],
        today: Callable[[], date] = date.today,
    ) -> None:
        self._folders = folders
        self._recordings = recordings
        self._now = now
        self._today = today
        self._day = today()
        self._followed: dict[Path, _Followed] = {}
        self._seen_dead: set[tuple[int, int]] = set()
        self._died_at: dict[str, float] = {}
        self._failing = False
        self._counted_at = now()

    def look(self) -> None:
        """Read new entries, and write the recordings that are due. Call this method each second. Raises
        nothing."""
        folders = list(self._folders())
        for folder in folders:
            self._look_at(folder)
        for folder in [known for known in self._followed if known not in folders]:
            self._finish(self._followed.pop(folder))
        if self._now() >= self._counted_at + COUNTED_S or self._today() != self._day:
            self._counted_at = self._now()
            for followed in self._followed.values():
                self._count(followed)
            self._day = self._today()

    def close(self) -> None:
        """Write the recordings that have begun, although they are incomplete. Add the counts of the
        devices to the file of daily counts."""
        for followed in self._followed.values():
            self._finish(followed)
        self._followed.clear()

    def _look_at(self, folder: Path) -> None:
        self._take_died(folder / DIED_NAME)
        try:
            followed = self._follow(folder)
            followed.take(self._now())
        except RingError:
            if folder in self._followed:
                self._finish(self._followed.pop(folder))
            return
        for due in followed.due(self._now()):
            self._put(*due)
        if not _runs(followed.head.pid):
            self._take_died(folder / NAME)

    def _follow(self, folder: Path) -> "_Followed":
        """Return the open ring of the run that the daemon is in now. Raises RingError."""
        followed = self._followed.get(folder)
        if followed is not None and not followed.is_replaced():
            return followed
        if followed is not None:
            self._finish(self._followed.pop(folder))
        self._followed[folder] = _Followed(folder / NAME, self._now())
        return self._followed[folder]

    def _finish(self, followed: "_Followed") -> None:
        for due in followed.due(float("inf")):
            self._put(*due)
        self._count(followed)

    def _count(self, followed: "_Followed") -> None:
        """Add the counts of the daemon's own devices to their day in the file of daily counts."""
        try:
            days.add(self._recordings.folder, self._day, followed.counts())
        except OSError as error:
            log.warning(pairs("not_counted", folder=self._recordings.folder, reason=error))

    def _take_died(self, path: Path) -> None:
        """Record the last minutes of a run that died, which means that it did not shut down cleanly.

        Each run is recorded only once. A run that made no decision is not recorded, because the log
        explains a failed start.
        """
        try:
            identity = _identity(path)
            if identity in self._seen_dead:
                return
            read = RingContent(path)
        except RingError:
            return
        self._seen_dead.add(identity)
        entries = list(read.entries())
        died = None if read.ended else death(entries)
        if died is not None and self._is_first(read.head):
            self._put(of_end(read.head, entries, (died,)), DEATH)

    def _is_first(self, head: Head) -> bool:
        """Return whether this run's death must be recorded. Return False if it is recorded already, or
        if another death of the same daemon was recorded in the last AGAIN_S."""
        last = self._died_at.get(head.file, AGES_AGO)
        if self._recordings.has_death(head) or self._now() < last + AGAIN_S:
            return False
        self._died_at[head.file] = self._now()
        return True

    def _put(self, incident: Incident, why: str) -> None:
        """Write a recording. If writing fails, the recording is lost. Log only the first of several
        failures in a row."""
        others = [followed.head.recording for followed in self._followed.values()]
        try:
            path = self._recordings.put(incident, wall_of(incident.entries), why, others)
        except OSError as error:
            if not self._failing:
                log.warning(pairs("not_recorded", folder=self._recordings.folder, reason=error))
            self._failing = True
            return
        self._failing = False
        if why != CONTINUOUS:
            told = "; ".join(f"{n.subject} {n.code} {n.text}".strip() for n in incident.notes)
            log.info(pairs("recorded", file=path, why=told))


class _Followed:
    """One ring that the recorder reads, and the recordings of this ring that have begun."""

    def __init__(self, path: Path, now: float) -> None:
        """Open the ring. Raises RingError."""
        self._tail = Tail(path)
        self.head = self._tail.head
        self._identity = _identity(path)
        self._triggers = Triggers(self.head.recording.waiting_s)
        self._since = now - LATE_S
        self._notes: list[Note] = []
        self._kept: RingContent | None = None
        self._part: list[AnyEntry] = []

    def is_replaced(self) -> bool:
        """Return whether the file at this path is now the ring of another run."""
        return _identity(self._tail.path) != self._identity

    def take(self, now: float) -> None:
        """Read new entries. Raises RingError."""
        new = self._tail.new()
        for entry in new:
            notes = self._triggers.take(entry)
            if entry.at >= self._since:
                self._notes += notes
        if self._notes and self._kept is None:
            self._kept = RingContent(self._tail.path)
        if self.head.recording.keep == "continuous":
            self._part += new

    def counts(self) -> Mapping[Key, DeviceCounts]:
        """Return the counts of the daemon's own devices since the last call."""
        found = self._triggers.tally.take_out()
        return {key: one for key, one in found.items() if key[0] == self.head.kind}

    def due(self, now: float) -> list[tuple[Incident, str]]:
        """Return the recordings that are complete at `now`. Return every recording that has begun if
        `now` is infinite."""
        found = []
        if self._notes and now >= self._notes[0].at + AFTER_S + GRACE_S:
            found.append(self._incident())
        if self._part and (now == float("inf") or now >= self._part[0].at + PART_S):
            found += self._continuous(whole=now == float("inf"))
        return found

    def _incident(self) -> tuple[Incident, str]:
        first = self._notes[0]
        end_at = first.at + AFTER_S
        notes = tuple(note for note in self._notes if note.at <= end_at)
        self._notes = [note for note in self._notes if note.at > end_at]
        read, self._kept = self._read(), None
        entries = part(list(read.entries()), first.at - BEFORE_S, end_at)
        return Incident(read.head, entries, notes), reason(first.code, first.text)

    def _read(self) -> RingContent:
        """Read the ring again. If the ring is gone, return its content from the time when the recording
        began."""
        try:
            read = RingContent(self._tail.path)
            if read.head.run == self.head.run:
                return read
        except RingError:
            pass
        assert self._kept
        return self._kept

    def _continuous(self, *, whole: bool) -> list[tuple[Incident, str]]:
        """Return the entries since the last file, up to the last entry from which a replay can start.
        The next file begins with that entry, so its replay needs no other file. With `whole`, return
        all entries."""
        known = [at for at in range(1, len(self._part)) if begins(self._part, at)]
        end = len(self._part) if whole or not known else known[-1]
        entries, self._part = self._part[:end], self._part[end:]
        return [(Incident(self.head, entries), CONTINUOUS)] if entries else []


def _runs(pid: int) -> bool:
    """Return whether a process with this pid exists."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def begins(entries: Sequence[AnyEntry], at: int) -> bool:
    """Return whether a replay of every subject can start at the entry with the index `at`."""
    following = entries[at + 1 : at + 2]
    return isinstance(entries[at], Clocks) and bool(following) and isinstance(following[0], Known)


def wall_of(entries: Sequence[AnyEntry]) -> float:
    """Return the wall clock's time (s since the epoch) of the last entry."""
    clocks = [entry for entry in entries if isinstance(entry, Clocks)]
    return clocks[-1].wall - clocks[-1].at + entries[-1].at if clocks else 0.0


def _identity(path: Path) -> tuple[int, int]:
    """Return the file's device and inode. Raises RingError if there is no file."""
    try:
        found = os.stat(path)
    except OSError as error:
        raise RingError(f"{path}: {error.strerror}") from None
    return found.st_dev, found.st_ino
