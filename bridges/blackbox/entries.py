"""The contents of a ring, which is the file in memory that holds a daemon's last minutes.

A head describes one run of a daemon. The entries tell what happened in that run. All times come from
the daemon's monotonic clock (s). A `Clocks` entry pairs such a time with the wall clock's time.

A subject is a lift, a door, a charger, or a coordinator's site. A pure function, the core, decides for
a subject from the subject's memory and an event. So a replay needs only the memory at one time and all
later events. From these it can repeat every later decision.
"""

from collections.abc import Callable
from typing import Annotated, Final, TypeVar

import msgspec
from msgspec import Meta

from bridges.blackbox.value_codec import Tree
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages.releases import RELEASES
from bridges.messages.rihs01 import MESSAGES

LATEST_S: Final = 4e9
"""The greatest absolute value (s) of a time. The sum of three such times is still a valid date, and
fits into an MCAP file."""
Seconds = Annotated[float, Meta(ge=-LATEST_S, le=LATEST_S)]
DEEPEST: Final = 60
"""The maximum depth of a tree of values. The deepest tree of a core's memory has about a tenth of this
depth."""
E = TypeVar("E")


class Invalid(ValueError):
    """Error for bytes that cannot be decoded as an entry or a head of this version. Its text gives the
    reason."""


class Head(msgspec.Struct, frozen=True):
    """The description of one run of a daemon: its software, and the device YAML that it serves.

    `file` is the YAML's path, and `yaml` is its text. `texts` holds the profiles and DBC files that the
    YAML uses.
    """

    run: Annotated[str, Meta(pattern=r"^[\w-]{1,64}$")]
    pid: Annotated[int, Meta(ge=0, lt=2**31)]
    version: str
    kind: str
    file: str
    yaml: bytes
    texts: dict[str, bytes]
    simulated: bool
    versions: dict[str, str]
    recording: RecordingSettings


class RingEntry(msgspec.Struct, frozen=True, array_like=True, tag_field="is"):
    """The base class of all entries."""

    at: Seconds


class Clocks(RingEntry, frozen=True, tag_field="is", tag=0):
    """A pair of times of one instant. `at`: by the monotonic clock. `wall`: by the wall clock, in
    seconds since the epoch."""

    wall: Seconds


class Spoken(RingEntry, frozen=True, tag_field="is", tag=1):
    """A message on RMF's graph (the nodes and topics of RMF). `sent`: whether the daemon sent or heard
    the message.

    `cdr`: the message's bytes on the wire, as `release` encodes them. `node`: the publisher's node,
    `/namespace/name`, or "" if the wire does not name the node.
    """

    sent: bool
    topic: str
    type: str
    release: str
    cdr: bytes
    node: str = ""


class Known(RingEntry, frozen=True, tag_field="is", tag=2):
    """A state of a subject from which a replay can start: memory, last reading, last outputs and last
    report.

    Reading, outputs and report are None before the first decision. `anew`: the memory does not come
    from the last recorded decision.
    """

    subject: str
    memory: Tree
    reading: Tree
    outputs: Tree
    report: Tree
    anew: bool = False


class Decided(RingEntry, frozen=True, tag_field="is", tag=3):
    """An event, and the core's decision on the event. `outputs`, `news` and `faults` are each an empty
    list if the decision has not changed them."""

    subject: str
    event: Tree
    wake_at: Tree
    refused: str = ""
    outputs: list[Tree] = []
    news: list[Tree] = []
    faults: list[Tree] = []
    publish: list[Tree] = []


class Same(RingEntry, frozen=True, tag_field="is", tag=4):
    """Further readings that were equal to the last reading and changed nothing. `times`: the time of
    each such reading, as packed doubles."""

    subject: str
    times: bytes


class Published(RingEntry, frozen=True, tag_field="is", tag=5):
    """The daemon has published the subject's report, and has noted this in the subject's memory."""

    subject: str


class SubjectForgotten(RingEntry, frozen=True, tag_field="is", tag=6):
    """The daemon has dropped the subject's memory."""

    subject: str


class DaemonDied(RingEntry, frozen=True, tag_field="is", tag=7):
    """The daemon ends because of a defect in its program."""

    reason: str


class EntriesLost(RingEntry, frozen=True, tag_field="is", tag=8):
    """The ring could not store `number` entries."""

    number: int


class DaemonEnded(RingEntry, frozen=True, tag_field="is", tag=9):
    """The daemon shut down cleanly. `safe`: the daemon verified that every output is off."""

    safe: bool


AnyEntry = (
    Clocks
    | Spoken
    | Known
    | Decided
    | Same
    | Published
    | SubjectForgotten
    | DaemonDied
    | EntriesLost
    | DaemonEnded
)

_ENCODER: Final = msgspec.msgpack.Encoder()
_DECODER: Final[msgspec.msgpack.Decoder[AnyEntry]] = msgspec.msgpack.Decoder(AnyEntry)
_JSON: Final[msgspec.json.Decoder[AnyEntry]] = msgspec.json.Decoder(AnyEntry)
_HEADS: Final = msgspec.msgpack.Decoder(Head)
_JSON_HEADS: Final = msgspec.json.Decoder(Head)


def encode(entry: AnyEntry | Head) -> bytes:
    """Encode an entry or a head."""
    return _ENCODER.encode(entry)


def decode(content: bytes) -> AnyEntry:
    """Decode an entry. Raises Invalid."""
    return _known(_decoded(_DECODER.decode, content))


def as_json(entry: AnyEntry | Head) -> str:
    """Return an entry or a head as JSON text."""
    return msgspec.json.encode(entry).decode()


def of_json(content: str) -> AnyEntry:
    """Decode an entry from JSON text. Raises Invalid."""
    return _known(_decoded(_JSON.decode, content))


def head_of_json(content: str) -> Head:
    """Decode a head from JSON text. Raises Invalid."""
    return _decoded(_JSON_HEADS.decode, content)


def decode_head(content: bytes) -> Head:
    """Decode a head. Raises Invalid."""
    return _decoded(_HEADS.decode, content)


def _decoded(decode: Callable[..., E], content: bytes | str) -> E:
    try:
        return decode(content)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise Invalid(f"damaged, or of another version: {error}") from None


def _known(entry: AnyEntry) -> AnyEntry:
    """Return the entry. Raises Invalid if this version does not know the entry's message type, or if a
    value is too deep."""
    if isinstance(entry, Spoken):
        kind, release = MESSAGES.get(entry.type), RELEASES.get(entry.release)
        if kind is None or release is None or not release.has(kind):
            raise Invalid(
                f"release {entry.release[:80]!r} has no known message {entry.type[:80]!r}"
            )
    elif isinstance(entry, Known):
        for tree in (entry.memory, entry.reading, entry.outputs, entry.report):
            _require_shallow(tree, DEEPEST)
    elif isinstance(entry, Decided):
        for tree in (entry.event, *entry.outputs, *entry.news, *entry.faults, *entry.publish):
            _require_shallow(tree, DEEPEST)
    return entry


def _require_shallow(tree: Tree, deeper: int) -> None:
    """Raise Invalid if the tree is nested more than `deeper` levels deep."""
    if isinstance(tree, dict | list):
        if deeper == 0:
            raise Invalid(f"a value is nested more than {DEEPEST} deep")
        for part in tree.values() if isinstance(tree, dict) else tree:
            _require_shallow(part, deeper - 1)
