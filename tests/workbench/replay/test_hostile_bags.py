"""Damaged and hostile recordings. The reader returns the readable parts in bounded memory, and reports
the damage."""

import io
import random
import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.writer import CompressionType, Writer

from bridges.messages import cdr
from bridges.messages.definitions import LiftState
from bridges.messages.releases import KILTED
from bridges.messages.texts import text
from tests.workbench.replay.test_bags import RIDE
from tests.workbench.replay.written import SQLITE, write
from workbench.replay.bags import BagError, Notes, heard_in
from workbench.replay.mcap_read import FIRST_UNPACKED, LONGEST_RECORD, MAGIC, MOST_DECLARED

NAME = "rmf_lift_msgs/msg/LiftState"


def states(number: int, *, compression: CompressionType = CompressionType.NONE) -> bytes:
    """Return an MCAP file with `number` lift states, in small chunks."""
    out = io.BytesIO()
    writer = Writer(out, chunk_size=1000, compression=compression)
    writer.start("ros2")
    schema = writer.register_schema(NAME, "ros2msg", text(LiftState, KILTED).encode())
    channel = writer.register_channel("/lift_states", "cdr", schema)
    for second in range(number):
        state = LiftState(lift_name=f"Lift{second}")
        at = second * 10**9
        writer.add_message(channel, at, cdr.encode(LiftState, state, KILTED), at)
    writer.finish()  # type: ignore[no-untyped-call]
    return out.getvalue()


def record(opcode: int, body: bytes, length: int | None = None) -> bytes:
    """Return a record. Its head states `length`, or by default the true length."""
    return struct.pack("<BQ", opcode, len(body) if length is None else length) + body


def chunk(compression: bytes, data: bytes, unpacked: int) -> bytes:
    """Return a chunk that claims to have `unpacked` bytes after decompression."""
    head = struct.pack("<QQQII", 0, 0, unpacked, 0, len(compression)) + compression
    return record(Opcode.CHUNK, head + struct.pack("<Q", len(data)) + data)


def read(path: Path, content: bytes) -> tuple[list[str], str]:
    """Return the names of the lifts, and the report of the damage without the file's path."""
    path.write_bytes(content)
    notes = Notes()
    found = [one.message.lift_name for one in heard_in(path, notes)]  # type: ignore[union-attr]
    return found, notes.damage.replace(str(path), "").replace(
        "; only the part before this place is used", ""
    )


def test_a_file_cut_anywhere_gives_what_was_complete(tmp_path: Path) -> None:
    whole = states(20)
    everything, unharmed = read(tmp_path / "a.mcap", whole)
    assert (everything, unharmed) == ([f"Lift{n}" for n in range(20)], "")

    gained = [0]
    for end in range(len(MAGIC), len(whole), 37):
        found, damage = read(tmp_path / "a.mcap", whole[:end])
        assert found == everything[: len(found)]
        assert damage.startswith(": the file ends in the middle") or found == everything
        gained.append(len(found))
    assert gained == sorted(gained)
    assert {0, 20} < set(gained)


def test_no_bytes_of_a_file_make_the_reader_fail(tmp_path: Path) -> None:
    chance = random.Random(7)
    whole = states(6, compression=CompressionType.ZSTD)
    for _ in range(400):
        broken = bytearray(whole)
        for _ in range(chance.randint(1, 8)):
            broken[chance.randrange(len(MAGIC), len(broken))] = chance.randrange(256)
        read(tmp_path / "a.mcap", bytes(broken))


@pytest.mark.parametrize(
    ("pack", "compression"),
    [(zstandard.compress, b"zstd"), (lz4.frame.compress, b"lz4")],
    ids=["zstd", "lz4"],
)
@pytest.mark.parametrize("says", [10, 4 * LONGEST_RECORD], ids=["a lie", "true"])
def test_what_unpacks_to_more_than_any_recording_is_not_unpacked(
    tmp_path: Path, pack: Callable[[bytes], bytes], compression: bytes, says: int
) -> None:
    packed = pack(bytes(4 * LONGEST_RECORD))
    bomb = MAGIC + chunk(compression, packed, says)
    del pack
    tracemalloc.start()
    _, damage = read(tmp_path / "a.mcap", bomb)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()

    said = (
        f"does not unpack to {says} bytes, its stated size"
        if says == 10
        else "unpacks to more than "
    )
    assert f"a chunk of {len(packed)} bytes {said}" in damage
    assert peak < 3 * LONGEST_RECORD


def test_many_chunks_that_unpack_to_much_are_stopped_early(tmp_path: Path) -> None:
    half = record(0x80, bytes(FIRST_UNPACKED // 2))
    part = chunk(b"zstd", zstandard.compress(half), len(half))
    _, damage = read(tmp_path / "a.mcap", MAGIC + 40 * part)

    assert "unpacks to more than" in damage


def test_two_kilobytes_of_tiny_records_are_not_worth_a_minute(tmp_path: Path) -> None:
    tiny = record(0x80, b"") * (LONGEST_RECORD // 9)
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + chunk(b"zstd", zstandard.compress(tiny), len(tiny)))
    notes = Notes()

    assert list(heard_in(path, notes)) == []
    assert "unpacks to more than 3" in notes.damage


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            record(Opcode.MESSAGE, b"", 2**63),
            ": the file ends in the middle of the record at byte 8",
        ),
        (record(Opcode.MESSAGE, b"ab"), ": the record at byte 8 is invalid: unpack_from requires"),
        (record(Opcode.SCHEMA, b"\1\0\xff\xff\xff\x7f"), ": the record at byte 8 is invalid:"),
        (chunk(b"brotli", b"", 0), ": the record at byte 8 is invalid: a chunk is compressed by"),
        (chunk(b"zstd", b"not zstd", 9), ": the record at byte 8 is invalid: "),
        (chunk(b"lz4", b"not lz4", 9), ": the record at byte 8 is invalid: "),
        (
            record(Opcode.SCHEMA, bytes(14)) * (MOST_DECLARED + 1),
            f"more than {MOST_DECLARED} channels and schemas",
        ),
    ],
    ids=["length", "message", "schema", "compression", "zstd", "lz4", "many schemas"],
)
def test_a_lie_in_a_file_ends_its_reading_with_the_reason(
    tmp_path: Path, content: bytes, said: str
) -> None:
    found, damage = read(tmp_path / "a.mcap", MAGIC + content)

    assert found == []
    assert said in damage


def test_a_file_longer_than_memory_is_not_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + record(Opcode.MESSAGE, b"", 2**40))
    with path.open("r+b") as sparse:
        sparse.truncate(2**41)
    notes = Notes()

    assert list(heard_in(path, notes)) == []
    assert "the record at byte 8 is longer than 64 MB" in notes.damage


def test_a_damaged_sqlite_recording_is_refused_with_what_may_mend_it(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", RIDE * 400, KILTED, SQLITE)
    database = next(bag.glob("*.db3"))
    content = bytearray(database.read_bytes())
    content[len(content) // 2 :] = bytes(len(content) - len(content) // 2)
    database.write_bytes(content)

    with pytest.raises(BagError, match=r"malformed; try the sqlite3 command \.recover"):
        list(heard_in(bag))
