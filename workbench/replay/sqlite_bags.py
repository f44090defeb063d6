"""Read RMF's messages from rosbag2's sqlite3 files, with the `rosbags` library."""

from collections.abc import Iterator
from pathlib import Path

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from bridges.messages.releases import Release
from workbench.replay.sources import BagError, Notes, Raw, releases, source


def raw_in(path: Path, notes: Notes) -> Iterator[Raw]:
    """Yield a recording's RMF messages, undecoded. `path` is a `.db3` file, or the file's directory.

    If the recording is damaged, stop there and write the damage into `notes`. Raises BagError if the
    recording cannot be opened.
    """
    began = False
    try:
        with Reader(path) as reader:
            if reader.compression_mode:  # a compressed message could unpack to any size
                raise BagError(f"{path} is compressed: ros2 bag convert can unpack it")
            began = True
            found = {c.id: source(c.topic, c.msgtype, _releases(c)) for c in reader.connections}
            for connection, at, sample in reader.messages():
                topic = found[connection.id]
                if topic.decode is None:
                    notes.skipped[topic.why] += 1
                else:
                    yield Raw(at, at, topic.topic, bytes(sample), topic.decode)
    except BagError:
        raise
    except Exception as error:  # arbitrary bytes can make the library raise any exception
        if not began:
            raise BagError(
                f"{path} cannot be read: {error}; try the sqlite3 command .recover on the .db3 file"
            ) from error
        notes.damaged(path, error)


def _releases(connection: Connection) -> list[Release]:
    definition = connection.msgdef
    text = definition.data if definition.format.name == "MSG" else ""
    return releases(connection.msgtype, text, connection.digest or "")
