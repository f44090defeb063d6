"""The present inputs and outputs of a daemon on this machine, read from the daemon's ring.

The ring is a file of fixed size with the daemon's latest decisions. It has the contacts as the driver
decodes them, and the decisions of the daemon's core, but no voltages.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from bridges.blackbox.entries import AnyEntry, Decided, Known
from bridges.blackbox.incident import ERRORS, READING
from bridges.blackbox.ring import NAME, RingError, Tail
from bridges.blackbox.value_codec import HOLDS, TYPE, Tree

Rows = Mapping[str, str]
"""Name -> present value."""


class Levels:
    """A reader that follows one daemon's ring. `sensed` is device name -> its inputs. `driven` is
    device name -> its outputs."""

    def __init__(self, folder: Path) -> None:
        self.sensed: dict[str, Rows] = {}
        self.driven: dict[str, Rows] = {}
        self._path = folder / NAME
        self._tail: Tail | None = None
        self._inode = 0

    def look(self) -> None:
        """Read the new entries. If the ring cannot be read, forget all values."""
        try:
            inode = self._path.stat().st_ino
            if self._tail is None or inode != self._inode:
                self._tail, self._inode = Tail(self._path), inode
            self.take(self._tail.new())
        except (OSError, RingError):
            self._tail = None
            self.sensed, self.driven = {}, {}

    def take(self, entries: Iterable[AnyEntry]) -> None:
        """Take entries of the ring, in order."""
        for entry in entries:
            if isinstance(entry, Known):
                self._event(entry.subject, entry.reading)
                self._outputs(entry.subject, entry.outputs)
            elif isinstance(entry, Decided):
                self._event(entry.subject, entry.event)
                for outputs in entry.outputs:
                    self._outputs(entry.subject, outputs)

    def _event(self, subject: str, event: Tree) -> None:
        if not isinstance(event, dict):
            return
        if event.get(TYPE) == READING:
            self.sensed[subject] = dict(_fields(event.get("sample")))
        elif event.get(TYPE) in ERRORS:
            self.sensed[subject] = {"the last reading": f"failed: {event.get('reason')}"}

    def _outputs(self, subject: str, outputs: Tree) -> None:
        if isinstance(outputs, dict):
            self.driven[subject] = dict(_fields(outputs))


def _fields(tree: Tree) -> Iterator[tuple[str, str]]:
    if isinstance(tree, dict):
        for name, value in tree.items():
            if name != TYPE:
                yield name.replace("_", " "), in_words(value)


def in_words(value: Tree) -> str:
    """Describe a value in a few words."""
    match value:
        case None | "":
            return "-"
        case bool():
            return "on" if value else "off"
        case float():
            return f"{value:g}"
        case list():
            return ", ".join(map(in_words, value)) or "none"
        case dict() if HOLDS in value:
            held = value[HOLDS]
            return held.lower().replace("_", " ") if isinstance(held, str) else in_words(held)
        case dict():
            return ", ".join(f"{name} {told}" for name, told in _fields(value)) or "-"
        case _:
            return str(value)[:200]
