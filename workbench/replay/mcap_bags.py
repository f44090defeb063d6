"""Read RMF's messages from an MCAP file. The writer is our recorder or rosbag2."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from mcap.records import Channel, Header, McapRecord, Message, Schema

from bridges.blackbox.incident import LIBRARY, OWN_TOPICS
from bridges.messages.heard import Sender
from bridges.messages.releases import Release
from bridges.messages.words import LONGEST_NAME
from workbench.replay.mcap_read import Damaged, records
from workbench.replay.sources import Notes, Raw, Source, releases, source

NO_CHANNEL: Final = Source("", None, "of no channel")


def raw_in(path: Path, notes: Notes) -> Iterator[Raw]:
    """Yield a file's RMF messages, undecoded. If the file is damaged, stop there and write the damage
    into `notes`."""
    declared = _Declared()
    try:
        for record in records(path):
            if isinstance(record, Message):
                found = declared.sources.get(record.channel_id, NO_CHANNEL)
                if found.decode is None and not declared.is_ours(found):
                    notes.skipped[found.why] += 1
                    continue
                wall = record.publish_time if declared.ours else record.log_time
                sender = declared.senders.get(record.channel_id)
                yield Raw(record.log_time, wall, found.topic, record.data, found.decode, sender)
            else:
                declared.take(record)
    except (Damaged, OSError) as error:
        notes.damaged(path, error)


class _Declared:
    """The declarations of a file that were read so far: its writer, its types and its channels.

    - `ours`: whether our recorder wrote the file.
    - `sources`: channel -> source.
    - `senders`: channel -> publisher.
    """

    def __init__(self) -> None:
        self.ours = False
        self.sources: dict[int, Source] = {}
        self.senders: dict[int, Sender] = {}
        self._types: dict[int, tuple[str, list[Release]]] = {}

    def is_ours(self, found: Source) -> bool:
        """Return whether this topic has texts that our recorder wrote itself."""
        return self.ours and found.topic.startswith(OWN_TOPICS)

    def take(self, record: McapRecord) -> None:
        """Note a header, a schema or a channel."""
        if isinstance(record, Header):
            self.ours = record.library.startswith(LIBRARY)
        elif isinstance(record, Schema):
            text = record.data if record.encoding == "ros2msg" else b""
            self._types[record.id] = (
                record.name,
                releases(record.name, text.decode("utf-8", "replace")),
            )
        elif isinstance(record, Channel):
            name, found = self._types.get(record.schema_id, ("", []))
            is_cdr = record.message_encoding == "cdr"
            self.sources[record.id] = source(record.topic, name if is_cdr else "", found)
            if self.ours and (node := record.metadata.get("node")):
                self.senders[record.id] = Sender(node[:LONGEST_NAME])
