"""Read our recorder's files for a replay. A file has the head of a daemon's run, and the run's entries
(the recorded events and decisions)."""

from collections.abc import Iterator
from pathlib import Path

import msgspec
from mcap.records import Channel, Message, Metadata

from bridges.blackbox import entries
from bridges.blackbox.entries import AnyEntry, Head
from bridges.blackbox.incident import Note
from bridges.blackbox.mcap_write import ENTRIES, HEAD, NOTES, String
from bridges.messages import cdr
from workbench.replay.mcap_read import Damaged, records
from workbench.replay.sources import BagError, Notes, NotReplayable

NONE = "{} has no recorded decisions of an rmf-bridge daemon, and only these can be replayed"


def head_of(path: Path) -> Head:
    """Return the daemon's run in this file. Raises BagError."""
    try:
        for record in records(path):
            if isinstance(record, Metadata) and record.name == HEAD:
                return entries.head_of_json(record.metadata.get("head", ""))
    except OSError as error:
        raise BagError(f"{path} cannot be read: {error.strerror}") from None
    except (Damaged, entries.Invalid) as error:
        raise BagError(f"{path}: {error}") from None
    raise NotReplayable(NONE.format(path))


def entries_in(path: Path, notes: Notes) -> Iterator[AnyEntry]:
    """Yield a file's entries in order. If the file is damaged, stop there and write the damage into
    `notes`."""
    for told in _texts(path, ENTRIES, notes):
        try:
            yield entries.of_json(told)
        except entries.Invalid as error:
            notes.damaged(path, f"an entry is invalid: {error}")
            return


def notes_in(path: Path) -> list[Note]:
    """Return the recorder's reasons to keep the file."""
    try:
        return [msgspec.json.decode(told, type=Note) for told in _texts(path, NOTES, Notes())]
    except (msgspec.MsgspecError, RecursionError):
        return []


def _texts(path: Path, topic: str, notes: Notes) -> Iterator[str]:
    """Yield the texts that our recorder wrote on this topic."""
    channels = set()
    try:
        for record in records(path):
            if isinstance(record, Channel) and record.topic == f"/{topic}":
                channels.add(record.id)
            elif isinstance(record, Message) and record.channel_id in channels:
                yield cdr.decode(String, record.data).data
    except (OSError, Damaged, cdr.CdrError) as error:
        notes.damaged(path, error)
