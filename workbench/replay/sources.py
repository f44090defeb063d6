"""The topics of a recording. This module recognises RMF's topics, and decodes their samples."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from bridges.messages import cdr, topics
from bridges.messages.definitions import Message
from bridges.messages.heard import Sender
from bridges.messages.releases import NEWEST, RELEASES, Release
from bridges.messages.rihs01 import MESSAGES
from bridges.messages.rihs01 import releases_of as releases_of_hash
from bridges.messages.texts import releases_of
from bridges.messages.words import LONGEST_NAME

TOPICS: Final = frozenset(topic.name for topic in topics.every())


class BagError(Exception):
    """The path has no readable recording. The error's text gives the remedy."""


class NotReplayable(BagError):
    """The recording is readable, but no decision in the recording can be replayed."""


@dataclass(slots=True)
class Notes:
    """Notes about missing parts. `skipped` is reason -> number of skipped messages. `damage` tells why
    the end of a recording could not be read, or is ""."""

    skipped: Counter[str] = field(default_factory=Counter)
    damage: str = ""

    def damaged(self, path: object, why: object) -> None:
        """Note why the rest of a file is missing."""
        told = f"{path}: {why}; only the part before this place is used"
        self.damage = f"{self.damage}; {told}" if self.damage else told


class Raw(NamedTuple):
    """A recorded message, undecoded.

    - `at`: time (ns) on the recorder's clock.
    - `wall`: time (ns) on the wall clock.
    - `decode`: a function that decodes the sample; None if the sample is one of our recorder's texts.
    - `sender`: the publisher that our recorder has noted.
    """

    at: int
    wall: int
    topic: str
    sample: bytes
    decode: Callable[[bytes], Message] | None
    sender: Sender | None = None


class Source(NamedTuple):
    """A recorded topic. If the topic cannot be used, `decode` is None, and `why` gives the reason."""

    topic: str
    decode: Callable[[bytes], Message] | None
    why: str = ""


def source(topic: str, type_name: str, releases: list[Release]) -> Source:
    """Return the source for a topic of this type. `releases` lists the type's possible releases."""
    topic = topic.removeprefix("/")
    short = topic[:LONGEST_NAME]
    message_type = MESSAGES.get(type_name)
    if message_type is None or not (type_name.startswith("rmf_") or topic in TOPICS):
        return Source(topic, None, f"{short}: not RMF's")
    if not releases:
        return Source(
            topic, None, f"{short}: {type_name}, from an unknown release of RMF's messages"
        )
    return Source(topic, lambda sample: _decoded(message_type, sample, releases))


def releases(type_name: str, definition: str, digest: str = "") -> list[Release]:
    """Return the releases of RMF's messages that may have written a message of this type. If the
    recording tells the release, return only this release. Otherwise return all releases that have
    the type.

    `definition` is the type's text, or "". `digest` is the type's RIHS01 hash, or "".
    """
    message_type = MESSAGES.get(type_name)
    if message_type is None:
        return []
    if definition:
        return releases_of(message_type, definition)
    if digest:
        return releases_of_hash(digest)
    return [r for r in dict.fromkeys((NEWEST, *RELEASES.values())) if r.has(message_type)]


def _decoded(message_type: type[Message], sample: bytes, releases: Iterable[Release]) -> Message:
    """Decode with the first release that fits. If no release fits, raises the last release's
    CdrError."""
    error = cdr.CdrError("no release")
    for release in releases:
        try:
            return cdr.decode(message_type, sample, release)
        except cdr.CdrError as refused:
            error = refused
    raise error
