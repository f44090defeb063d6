"""Read the records of any writer's MCAP file, in limited memory. The time for reading grows only with
the file's size.

The reader checks everything in the file before use. A length may be false, a chunk may unpack to
gigabytes, and the end may be missing. The reader ignores the index, so the index may be missing.
Format: https://mcap.dev/spec (version 0).
"""

import io
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Final

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, McapRecord, Message, Metadata, Schema

MAGIC: Final = b"\x89MCAP0\r\n"
LONGEST_RECORD: Final = 64 << 20
"""Maximum size (bytes) of a record and of an unpacked chunk. rosbag2 and Foxglove write chunks of 1 to
8 MB."""
MOST_UNPACKED: Final = 200
FIRST_UNPACKED: Final = 2 << 20
"""MOST_UNPACKED and FIRST_UNPACKED limit a file's unpacked size (bytes). The limit is MOST_UNPACKED
times the file's size, plus FIRST_UNPACKED."""
MOST_DECLARED: Final = 10_000
"""Maximum number of schemas and channels in a file."""
FRAME: Final = 9
"""Size (bytes) of a record's head: its opcode (1 byte) and its length (8 bytes)."""

MESSAGE: Final = struct.Struct("<HIQQ")
"""The head of a message: channel, sequence, log time and publish time (ns).

Messages are the most frequent records. Therefore this code decodes the head itself, which is faster
than the library.
"""
READ: Final[dict[int, Callable[[ReadDataStream], McapRecord]]] = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
}
INVALID: Final = (
    McapError,
    ValueError,
    OverflowError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,
)
"""Exceptions that may come from parsing arbitrary bytes as a record."""
LAST: Final = (Opcode.DATA_END, Opcode.FOOTER)


class Damaged(ValueError):
    """The file cannot be read further. The error's text gives the reason."""


def records(path: Path) -> Iterator[McapRecord]:
    """Yield every header, schema, channel, message and metadata record, in the file's order.

    Raises OSError. Raises Damaged at the place after which the file cannot be read.
    """
    size = path.stat().st_size
    with path.open("rb") as source:
        if source.read(len(MAGIC)) != MAGIC:
            raise Damaged("the file does not begin as an MCAP file")
        yield from _Allowances(size).records(source, size)


class _Allowances:
    """The amounts that a file may still contain: bytes to unpack, and channels and schemas to
    declare."""

    def __init__(self, size: int) -> None:
        self._unpacked = FIRST_UNPACKED + MOST_UNPACKED * size
        self._declared = MOST_DECLARED

    def records(self, source: IO[bytes], size: int) -> Iterator[McapRecord]:
        """Yield the records from the present position to the end of the data."""
        while True:
            at = source.tell()
            opcode, body = _body(source, at, size)
            if opcode in LAST:
                return
            try:
                yield from self._opened(opcode, body)
            except INVALID as error:
                why = str(error) or type(error).__name__
                raise Damaged(f"the record at byte {at} is invalid: {why}") from error

    def _opened(self, opcode: int, body: bytes) -> Iterator[McapRecord]:
        if opcode != Opcode.CHUNK:
            yield from self._one(opcode, body)
            return
        unpacked = self._unpack(Chunk.read(_stream(body)))
        source, size = io.BytesIO(unpacked), len(unpacked)
        while source.tell() < size:
            yield from self._one(*_body(source, source.tell(), size))

    def _one(self, opcode: int, body: bytes) -> Iterator[McapRecord]:
        if opcode == Opcode.MESSAGE:
            channel, sequence, at, published = MESSAGE.unpack_from(body)
            yield Message(channel, at, body[MESSAGE.size :], published, sequence)
        elif read := READ.get(opcode):
            self._declared -= opcode in (Opcode.SCHEMA, Opcode.CHANNEL)
            if self._declared < 0:
                raise Damaged(f"more than {MOST_DECLARED} channels and schemas")
            yield read(_stream(body))

    def _unpack(self, chunk: Chunk) -> bytes:
        size, most = chunk.uncompressed_size, min(LONGEST_RECORD, self._unpacked)
        if size > most:
            raise Damaged(f"a chunk of {len(chunk.data)} bytes unpacks to more than {most}")
        if chunk.compression == "zstd":
            reader = zstandard.ZstdDecompressor(max_window_size=LONGEST_RECORD).stream_reader(
                chunk.data
            )
            unpacked = reader.read(size + 1)
        elif chunk.compression == "lz4":
            unpacked = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, size + 1)
        elif chunk.compression == "":
            unpacked = chunk.data
        else:
            raise Damaged(f"a chunk is compressed by {chunk.compression[:20]!r}, not zstd or lz4")
        if len(unpacked) != size:
            raise Damaged(
                f"a chunk of {len(chunk.data)} bytes does not unpack to {size} bytes, its stated size"
            )
        self._unpacked -= size
        return unpacked


def _stream(body: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(body))


def _body(source: IO[bytes], at: int, size: int) -> tuple[int, bytes]:
    """Read the next record's opcode and content. Raises Damaged."""
    frame = source.read(FRAME)
    if len(frame) < FRAME:
        raise Damaged(f"the file ends in the middle, at byte {at}")
    length = int.from_bytes(frame[1:], "little")
    if length > size - at - FRAME:
        raise Damaged(f"the file ends in the middle of the record at byte {at}")
    if length > LONGEST_RECORD:
        raise Damaged(f"the record at byte {at} is longer than {LONGEST_RECORD >> 20} MB")
    return frame[0], source.read(length)
