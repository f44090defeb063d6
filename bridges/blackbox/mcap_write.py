"""Writes an incident as an MCAP file for Foxglove, PlotJuggler and `ros2 bag`.

rosbag2 refuses a file whose topics have more than one encoding (rosbag2_cpp, sequential_reader.cpp,
`check_topics_serialization_formats`). So our own data is JSON text in `std_msgs/msg/String`.

Our topics begin with `/rmf_bridge/`. `rmf-bridge replay` repeats decisions from the topic `entries`.
The other topics are for people.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import msgspec
from mcap.writer import CompressionType, Writer

from bridges import __version__
from bridges.blackbox import entries
from bridges.blackbox.entries import AnyEntry, Decided, Spoken
from bridges.blackbox.incident import LIBRARY, OWN_TOPICS, Incident, readable, timed
from bridges.blackbox.value_codec import Tree
from bridges.messages import cdr, topics
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import MESSAGES, type_hash
from bridges.messages.texts import text

ENTRIES: Final = f"{OWN_TOPICS}entries"
NOTES: Final = f"{OWN_TOPICS}notes"
HEAD: Final = "rmf_bridge"
CHUNK: Final = 256 * 1024
MOST_CHANNELS: Final = 500
"""The maximum number of channels with a publisher's name. After that, further publishers share channels
without a name."""
QOS: Final = """\
- history: 1
  depth: {depth}
  reliability: 1
  durability: {durability}
  deadline: {{sec: 9223372036, nsec: 854775807}}
  lifespan: {{sec: 9223372036, nsec: 854775807}}
  liveliness: 1
  liveliness_lease_duration: {{sec: 9223372036, nsec: 854775807}}
  avoid_ros_namespace_conventions: false
"""
"""The QoS of a topic in the form of rosbag2's metadata up to version 8. Later releases of rosbag2 read
this form too."""
BAG: Final = """\
version: 8
storage_identifier: mcap
duration: {{nanoseconds: 0}}
starting_time: {{nanoseconds_since_epoch: 0}}
message_count: 0
topics_with_message_count: []
compression_format: ""
compression_mode: ""
relative_file_paths: []
files: []
custom_data: ~
ros_distro: {distro}
"""
"""The metadata for rosbag2. rosbag2 uses only the version, and reads the rest from the file's index."""
KNOWN_QOS: Final = {topic.name: topic.publish for topic in topics.every()}


@dataclass(frozen=True, slots=True)
class String:
    """std_msgs/msg/String."""

    data: str = ""


def write(path: Path, incident: Incident) -> None:
    """Write an incident to a file. The file has a temporary name until it is complete. Raises
    OSError."""
    new = path.with_name(f".{path.name}.part")
    try:
        with new.open("wb") as out:
            _write(Writer(out, CHUNK, CompressionType.ZSTD), incident)
            out.flush()
            os.fsync(out.fileno())
        os.replace(new, path)
    except BaseException:
        new.unlink(missing_ok=True)
        raise


def _write(writer: Writer, incident: Incident) -> None:
    writer.start("ros2", f"{LIBRARY} {__version__}")
    spoken = next((e for e in incident.entries if isinstance(e, Spoken)), None)
    writer.add_metadata("rosbag2", {"serialized_metadata": BAG.format(distro=_distro(spoken))})
    writer.add_metadata(HEAD, {"head": entries.as_json(incident.head)})
    channels = _Channels(writer)
    waiting = list(incident.notes)
    steady = wall = 0.0
    for entry, steady, wall in timed(incident.entries):
        while waiting and waiting[0].at <= entry.at:
            channels.say(NOTES, msgspec.to_builtins(waiting.pop(0)), steady, wall)
        _entry(channels, entry, steady, wall)
    for note in waiting:
        channels.say(NOTES, msgspec.to_builtins(note), steady, wall)
    writer.finish()  # type: ignore[no-untyped-call]


def _distro(spoken: Spoken | None) -> str:
    return spoken.release if spoken else "jazzy"


def _entry(channels: "_Channels", entry: AnyEntry, steady: float, wall: float) -> None:
    if isinstance(entry, Spoken):
        channels.spoken(entry, steady, wall)
        return
    channels.text(ENTRIES, entries.as_json(entry), steady, wall)
    if isinstance(entry, Decided):
        for topic, told in readable(entry):
            channels.say(OWN_TOPICS + topic, told, steady, wall)


class _Channels:
    """The schemas and channels of one file. A schema or channel is declared when a message first needs
    it."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels: dict[tuple[str, ...], int] = {}

    def spoken(self, spoken: Spoken, steady: float, wall: float) -> None:
        """Write a message of RMF. Its bytes are those from the wire."""
        way = "sent" if spoken.sent else "heard"
        key = (spoken.topic, spoken.type, spoken.release, way, spoken.node)
        if key not in self._channels and len(self._channels) >= MOST_CHANNELS:
            key = (*key[:-1], "")  # leave out the node's name, because somebody invents names
        if key not in self._channels:
            self._channels[key] = self._declare(spoken, way, key[-1])
        self._add(self._channels[key], spoken.cdr, steady, wall)

    def say(self, topic: str, told: Tree, steady: float, wall: float) -> None:
        """Write our own data as JSON."""
        self.text(topic, msgspec.json.encode(told).decode(), steady, wall)

    def text(self, topic: str, told: str, steady: float, wall: float) -> None:
        """Write our own text."""
        if (topic,) not in self._channels:
            schema = self._schema("std_msgs/msg/String", "", "string data\n")
            qos = {"offered_qos_profiles": QOS.format(depth=100, durability=2)}
            self._channels[(topic,)] = self._writer.register_channel(
                f"/{topic}", "cdr", schema, qos
            )
        self._add(self._channels[(topic,)], cdr.encode(String, String(told)), steady, wall)

    def _declare(self, spoken: Spoken, way: str, node: str) -> int:
        kind, release = MESSAGES[spoken.type], RELEASES[spoken.release]
        schema = self._schema(spoken.type, spoken.release, text(kind, release))
        qos = KNOWN_QOS.get(spoken.topic, topics.VOLATILE)
        durability = 1 if qos.durability == "transient_local" else 2
        told = {
            "offered_qos_profiles": QOS.format(depth=qos.depth, durability=durability),
            "topic_type_hash": type_hash(kind, release),
            "way": way,
            "node": node,
        }
        return self._writer.register_channel(f"/{spoken.topic}", "cdr", schema, told)

    def _schema(self, name: str, release: str, definition: str) -> int:
        key = (name, release)
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(name, "ros2msg", definition.encode())
        return self._schemas[key]

    def _add(self, channel: int, sample: bytes, steady: float, wall: float) -> None:
        at, published = max(0, round(steady * 1e9)), max(0, round(wall * 1e9))
        self._writer.add_message(channel, at, sample, published)
