"""List the recordings in a folder, and explain a recording. The page never reads another folder.

A recording may come from elsewhere and be hostile. Therefore a separate process reads the recording
(`python -m workbench.page.incidents FILE`), with limited memory and time.
"""

import asyncio
import resource
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import tzinfo
from pathlib import Path
from typing import Final

import msgspec

from bridges.blackbox.recordings import SUFFIX, named
from bridges.messages.heard import Heard, Own
from bridges.runtime import faults
from workbench.explain import heard_devices
from workbench.explain.answer import Remedies
from workbench.explain.device_timeline import Drawing
from workbench.explain.explanation import Explanation
from workbench.explain.noted import noted
from workbench.explain.rows import label
from workbench.explain.timeline import Mark, Timeline
from workbench.page.zone import zone_of
from workbench.replay.bags import all_in
from workbench.replay.sources import BagError, Notes

MOST_LISTED: Final = 500
MOST_REASONS: Final = 20
MOST_DEVICES: Final = 50
"""Maximum number of one recording's devices on the page. The page also tells the number of further
devices."""
LONGEST_S: Final = 20.0
"""Maximum time (s) for reading a recording. What could not be read in this time is left out, and the
page says so."""

ENDED_S: Final = 60.0
"""Time (s) after which the page kills the reading process. Reading takes so long only if a recording is
full of messages that are not RMF's."""
MOST_MEMORY: Final = 128 << 20
"""Maximum memory (bytes) of the reading process. The systemd unit allows 256 MB for this process and
the page together."""


@dataclass(frozen=True, slots=True)
class File:
    """A recording in the folder. `wall` is the time in its name, in seconds since the epoch. If the
    name has no time, `wall` is the time of the last write.

    `device` and `reason` come from the name that our recorder gives a file. For other files, both are
    "".
    """

    name: str
    size: int
    wall: float
    device: str = ""
    reason: str = ""

    @property
    def title(self) -> str:
        """The device and the reason. If a person has named the file, the title is the file's name."""
        return f"{self.device}: {self.reason.replace('-', ' ')}" if self.device else self.name


@dataclass(frozen=True, slots=True)
class ExplainedRecording:
    """A recording with each device's explanation and timeline, and with a list of the unreadable parts.

    `reasons` are notes of the recorder, each with its time (s) and text.
    """

    devices: tuple[tuple[Explanation, Timeline], ...]
    notes: tuple[str, ...]
    reasons: tuple[tuple[float, str], ...] = ()

    def opens_at(self, timeline: Timeline) -> float:
        """Return the moment for which the file was kept, as a fraction of the timeline's length. Return
        1 if there is no such moment."""
        length = timeline.to_s - timeline.from_s
        at = max((at for at, _ in self.reasons), default=timeline.to_s)
        return min(1.0, max(0.0, (at - timeline.from_s) / length)) if length else 1.0


def listed(folder: Path) -> list[File]:
    """Return the recordings of the folder, newest first. Raises OSError."""
    found = sorted(_files(folder), key=lambda one: one.wall, reverse=True)
    return found[:MOST_LISTED]


def _files(folder: Path) -> Iterator[File]:
    for path in folder.iterdir():
        if path.suffix == SUFFIX and path.is_file() and not path.is_symlink():
            found = path.stat()
            yield File(path.name, found.st_size, *(named(path) or (found.st_mtime,)))


def file_in(folder: Path, name: str) -> File | None:
    """Return the recording of this name. Return None if the folder has no such recording. Raises
    OSError."""
    return next((one for one in _files(folder) if one.name == name), None)


async def read_apart(path: Path, zone: str = "") -> ExplainedRecording:
    """Run `read` in a separate process. `zone` is the name of the browser's time zone. Raises
    BagError."""
    child = await asyncio.create_subprocess_exec(
        sys.executable,
        "-P",
        "-m",
        __name__,
        str(path.absolute()),
        zone,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
    )
    try:
        told, _ = await asyncio.wait_for(child.communicate(), ENDED_S)
    except TimeoutError:
        raise BagError(f"{path} takes more than {ENDED_S:.0f} s to read") from None
    finally:
        if child.returncode is None:
            child.kill()
    if child.returncode:
        raise BagError(told.decode() or f"{path} cannot be read")
    return _RECORDING.decode(told)


def main(path: Path, zone: str) -> int:
    """Read a recording. Write its explanation to standard output. If the recording cannot be read,
    write the reason."""
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, MOST_MEMORY))
    try:
        code, told = 0, msgspec.msgpack.encode(read(path, faults.for_explain(), zone_of(zone)))
    except BagError as error:
        code, told = 1, str(error).encode()
    except MemoryError:
        code, told = 1, f"{path} takes too much memory to read".encode()
    sys.stdout.buffer.write(told)
    return code


def read(path: Path, remedies: Remedies, zone: tzinfo | None = None) -> ExplainedRecording:
    """Read the recording in limited time. `zone` is the time zone of the texts. Raises BagError if the
    file is no recording."""
    notes, story = Notes(), heard_devices.HeardDevices()
    cut = not _all_of(path, notes, story.take)
    devices = [(kind, name) for kind, name in story.devices() if kind != "robot"]
    drawings = {key: Drawing(*key) for key in devices[:MOST_DEVICES]}

    reasons: list[tuple[float, str]] = []

    def draw(heard: Heard | Own) -> None:
        if isinstance(heard, Own) and len(reasons) < MOST_REASONS:
            reasons.extend(_reason(heard))
        for drawing in drawings.values():
            drawing.take(heard)

    cut = not _all_of(path, Notes(), draw) or cut
    told = [
        (story.explain(*key, zone, remedies), _marked(one.timeline(), reasons))
        for key, one in drawings.items()
    ]
    said = tuple(_notes(notes, len(devices), cut=cut))
    return ExplainedRecording(tuple(told), said, tuple(reasons))


def _reason(own: Own) -> Iterator[tuple[float, str]]:
    """Yield the time and text of the recorder's reason to keep the file. Yield nothing for other
    notes."""
    note = noted(own.topic.rpartition("/")[2], own.text)
    if note is not None and note.kept_for is not None:
        code, text = note.kept_for
        yield own.at, label(": ".join(filter(None, (code, note.subject, text))))


def _marked(timeline: Timeline, reasons: Sequence[tuple[float, str]]) -> Timeline:
    """Return the timeline with a mark at each reason to keep the file."""
    marks = [Mark(at, text, "wrong") for at, text in reasons]
    return replace(timeline, steps=(*timeline.steps, *marks))


def _all_of(path: Path, notes: Notes, take: Callable[[Heard | Own], None]) -> bool:
    """Take the messages of a recording. Return whether the time was enough for all messages."""
    until = time.monotonic() + LONGEST_S
    for heard in all_in(path, notes):
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


_RECORDING: Final = msgspec.msgpack.Decoder(ExplainedRecording)

__all__ = ["BagError", "ExplainedRecording", "File", "file_in", "listed", "read", "read_apart"]

if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2]))
