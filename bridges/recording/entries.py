"""What a ring holds: the head of a daemon's run, and its entries.

All times are by the daemon's monotonic clock (s); `Clocks` says what the wall clock showed then.
A subject is a lift, a door, a charger, or a coordinator's site. Its core is a pure function, so its
memory at one time and each event after it are enough to have every decision made again.
"""

from typing import Final

import msgspec

from bridges.recording.settings import Recording
from bridges.recording.trees import Tree


class Head(msgspec.Struct, frozen=True):
    """One run of a daemon: what it is made of, and the file that it serves.

    `file`: the YAML's path. `yaml`: its text. `texts`: profiles and DBC files that it uses.
    """

    run: str
    pid: int
    version: str
    kind: str
    file: str
    yaml: bytes
    texts: dict[str, bytes]
    simulated: bool
    versions: dict[str, str]
    recording: Recording


class Entry(msgspec.Struct, frozen=True, array_like=True, tag_field="is"):
    """Every entry."""

    at: float


class Clocks(Entry, frozen=True, tag_field="is", tag=0):
    """What the wall clock showed at this time (s since the epoch)."""

    wall: float


class Spoken(Entry, frozen=True, tag_field="is", tag=1):
    """A message heard from RMF's graph, or sent. `cdr`: as it is on the wire in `release`."""

    sent: bool
    topic: str
    type: str
    release: str
    cdr: bytes


class Known(Entry, frozen=True, tag_field="is", tag=2):
    """All that a replay needs to start here: a subject's memory, its last reading, and what was last
    decided; None before the first. `anew`: the memory is not what the last decision left."""

    subject: str
    memory: Tree
    reading: Tree
    outputs: Tree
    report: Tree
    anew: bool = False


class Step(Entry, frozen=True, tag_field="is", tag=3):
    """An event, and what the core decided. `outputs`, `news`, `faults`: only those that have
    changed."""

    subject: str
    event: Tree
    wake_at: Tree
    refused: str = ""
    outputs: list[Tree] = []
    news: list[Tree] = []
    faults: list[Tree] = []
    publish: list[Tree] = []


class Same(Entry, frozen=True, tag_field="is", tag=4):
    """The last reading came again at each of these times (doubles), and changed no decision."""

    subject: str
    times: bytes


class Published(Entry, frozen=True, tag_field="is", tag=5):
    """The subject's report went out, and its memory took note of that."""

    subject: str


class Forgotten(Entry, frozen=True, tag_field="is", tag=6):
    """The subject is no longer remembered."""

    subject: str


class Died(Entry, frozen=True, tag_field="is", tag=7):
    """A defect ends the daemon."""

    reason: str


class Lost(Entry, frozen=True, tag_field="is", tag=8):
    """This many entries could not be stored."""

    number: int


class Ended(Entry, frozen=True, tag_field="is", tag=9):
    """The daemon ended in good order. `safe`: every output was verified off."""

    safe: bool


AnyEntry = Clocks | Spoken | Known | Step | Same | Published | Forgotten | Died | Lost | Ended

_ENCODER: Final = msgspec.msgpack.Encoder()
_DECODER: Final[msgspec.msgpack.Decoder[AnyEntry]] = msgspec.msgpack.Decoder(AnyEntry)
_JSON: Final[msgspec.json.Decoder[AnyEntry]] = msgspec.json.Decoder(AnyEntry)
_HEADS: Final = msgspec.msgpack.Decoder(Head)


def encode(entry: AnyEntry | Head) -> bytes:
    """An entry, or a head, as bytes."""
    return _ENCODER.encode(entry)


def decode(content: bytes) -> AnyEntry:
    """Raises msgspec.MsgspecError."""
    return _DECODER.decode(content)


def as_json(entry: AnyEntry | Head) -> str:
    """An entry, or a head, as text."""
    return msgspec.json.encode(entry).decode()


def of_json(content: str) -> AnyEntry:
    """Raises msgspec.MsgspecError."""
    return _JSON.decode(content)


def head_of_json(content: str) -> Head:
    """Raises msgspec.MsgspecError."""
    return msgspec.json.decode(content, type=Head)


def decode_head(content: bytes) -> Head:
    """Raises msgspec.MsgspecError."""
    return _HEADS.decode(content)
