"""Recordings in the form of rosbag2. The library `rosbags` writes them with our own texts of RMF's
message definitions."""

from collections.abc import Iterable
from pathlib import Path

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from bridges.messages import cdr
from bridges.messages.heard import Heard
from bridges.messages.releases import Release
from bridges.messages.rihs01 import type_name
from bridges.messages.texts import text

MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3


def store(release: Release) -> Typestore:
    """Return the message types of a release. The types come from our own texts of the definitions."""
    types = get_typestore(Stores.EMPTY)
    for message_type in release.messages():
        own = text(message_type, release).partition("=" * 80)[0]
        types.register(get_types_from_msg(own, type_name(message_type)))
    return types


def write(
    bag: Path, heard: Iterable[Heard], release: Release, storage: StoragePlugin = MCAP
) -> Path:
    """Write a bag with these messages, and with one topic that RMF does not have."""
    types = store(release)
    with Writer(bag, version=9, storage_plugin=storage) as writer:
        other = writer.add_connection("/scan", "std_msgs/msg/Bool", typestore=types)
        known = {}
        for one in heard:
            kind = type(one.message)
            if one.topic not in known:
                known[one.topic] = writer.add_connection(
                    f"/{one.topic}", type_name(kind), typestore=types
                )
            at = round(one.wall * 1e9)
            writer.write(known[one.topic], at, cdr.encode(kind, one.message, release))
            writer.write(other, at, b"\0\1\0\0\1")
    return bag
