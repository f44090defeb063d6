"""The folder of recordings: what is in it, and one of them understood. No other folder is ever read."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridges.explain import site
from bridges.explain.answer import Remedies
from bridges.explain.explanation import Explanation
from bridges.explain.lanes import Drawing
from bridges.explain.timeline import Timeline
from bridges.recording.bags import heard_in
from bridges.recording.heard import Heard
from bridges.recording.sources import BagError, Notes

SUFFIX: Final = ".mcap"
MOST_LISTED: Final = 500
MOST_DEVICES: Final = 50
"""Of one recording; more are counted."""
LONGEST_S: Final = 20.0
"""A recording is read for so long at most; the rest of it is left out, and that is said."""


@dataclass(frozen=True, slots=True)
class File:
    """A recording in the folder. `wall`: when it was written last (s since the epoch)."""

    name: str
    size: int
    wall: float


@dataclass(frozen=True, slots=True)
class Recording:
    """What a recording tells: each device's explanation and timeline, and what could not be read."""

    devices: tuple[tuple[Explanation, Timeline], ...]
    notes: tuple[str, ...]


def listed(folder: Path) -> list[File]:
    """The newest recordings first. Raises OSError."""
    found = sorted(_files(folder), key=lambda one: one.wall, reverse=True)
    return found[:MOST_LISTED]


def _files(folder: Path) -> Iterator[File]:
    for path in folder.iterdir():
        if path.suffix == SUFFIX and path.is_file() and not path.is_symlink():
            found = path.stat()
            yield File(path.name, found.st_size, found.st_mtime)


def path_in(folder: Path, name: str) -> Path | None:
    """The recording of this name in the folder; None if there is none, whatever the name says."""
    return next((folder / one.name for one in _files(folder) if one.name == name), None)


def read(path: Path, remedies: Remedies) -> Recording:
    """The whole recording, in bounded time and memory. Raises BagError if it is none."""
    notes, story = Notes(), site.Site()
    cut = not _all_of(path, notes, story.take)
    devices = story.devices()
    drawings = {key: Drawing(*key) for key in devices[:MOST_DEVICES]}

    def draw(heard: Heard) -> None:
        for drawing in drawings.values():
            drawing.take(heard)

    cut = not _all_of(path, Notes(), draw) or cut
    told = [(story.explain(*key, None, remedies), one.timeline()) for key, one in drawings.items()]
    return Recording(tuple(told), tuple(_notes(notes, len(devices), cut=cut)))


def _all_of(path: Path, notes: Notes, take: Callable[[Heard], None]) -> bool:
    """Whether the time was enough for all of it."""
    until = time.monotonic() + LONGEST_S
    for heard in heard_in(path, notes):
        take(heard)
        if time.monotonic() > until:
            return False
    return True


def _notes(notes: Notes, devices: int, *, cut: bool) -> Iterator[str]:
    if notes.damage:
        yield f"The file is damaged: {notes.damage}"
    if cut:
        yield f"Only what could be read in {LONGEST_S:.0f} s is shown."
    if (more := devices - MOST_DEVICES) > 0:
        yield f"{more} more devices are not shown."


__all__ = ["BagError", "File", "Recording", "listed", "path_in", "read"]
