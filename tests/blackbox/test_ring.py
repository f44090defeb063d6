"""The ring, which is a file with a daemon's latest messages and decisions. Entries survive a kill, and
a reader ignores a torn last entry."""

from pathlib import Path

import pytest

from bridges.blackbox import entries
from bridges.blackbox.entries import AnyEntry, Head, SubjectForgotten
from bridges.blackbox.ring import DIED, MARK, SEGMENTS, Ring, RingContent, RingError, Tail
from bridges.kinds.shared.recording_section import RecordingSettings

HEAD = Head(
    "run1", 7, "0.1.0", "lift", "/l.yaml", b"kind: lift", {}, False, {}, RecordingSettings()
)
SIZE = 64 * 1024


def entry(number: int) -> AnyEntry:
    return SubjectForgotten(float(number), f"Lift{number}" * 20)


def write(ring: Ring, one: AnyEntry) -> None:
    content = entries.encode(one)
    if not ring.fits(len(content) + 8):
        ring.begin_segment()
    ring.write(ring.frame(content))


def test_what_was_written_is_read_with_its_head(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    for number in range(5):
        write(ring, entry(number))

    read = RingContent(ring.path)

    assert (read.head, read.ended) == (HEAD, False)
    assert list(read.entries()) == [entry(number) for number in range(5)]
    ring.close(ended=False)


def test_after_many_turns_the_newest_are_there_in_order_without_a_gap(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    for number in range(3000):
        write(ring, entry(number))
    ring.close(ended=False)

    found = list(RingContent(ring.path).entries())

    assert found == [entry(number) for number in range(3000 - len(found), 3000)]
    assert len(found) > 300


def test_an_entry_torn_at_any_byte_is_dropped_and_those_before_it_are_kept(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    for number in range(3):
        write(ring, entry(number))
    ring.close(ended=False)
    whole = ring.path.read_bytes()
    last = whole.rindex(b"Lift2" * 20) + 5 * 20

    for torn in range(1, len(entries.encode(entry(2))) + 8):
        ring.path.write_bytes(whole[: last - torn] + bytes(torn) + whole[last:])
        assert list(RingContent(ring.path).entries()) == [entry(0), entry(1)]


def test_an_entry_of_an_earlier_turn_is_not_taken_for_one_of_this(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    for _ in range(SEGMENTS + 1):
        ring.begin_segment()
        ring.write(b"".join(ring.frame(entries.encode(entry(n))) for n in range(10)))
    ring.begin_segment()
    ring.write(ring.frame(entries.encode(entry(99))))
    ring.close(ended=False)

    newest = max(RingContent(ring.path).segments)

    assert RingContent(ring.path).segments[newest] == [entry(99)]


def test_the_ring_of_a_run_that_died_is_kept_beside_the_next_one(tmp_path: Path) -> None:
    first = Ring(tmp_path, HEAD, SIZE)
    write(first, entry(1))
    first.close(ended=False)
    second = Ring(tmp_path, HEAD, SIZE)
    write(second, entry(2))
    second.close(ended=True)
    Ring(tmp_path, HEAD, SIZE).close(ended=True)

    assert list(RingContent(tmp_path / DIED).entries()) == [entry(1)]
    assert list(RingContent(tmp_path / "ring").entries()) == []


def test_a_ring_whose_file_was_removed_or_replaced_counts_as_gone(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    assert ring.lives
    ring.path.rename(tmp_path / "elsewhere")
    assert not ring.lives
    ring.path.touch()
    assert not ring.lives
    ring.close(ended=False)


@pytest.mark.parametrize("content", [b"", b"x" * 5000, b"RMFRING1" + b"\xff" * 5000])
def test_a_file_that_is_not_a_ring_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "ring").write_bytes(content)

    with pytest.raises(RingError):
        RingContent(tmp_path / "ring")


def test_a_segment_whose_number_was_torn_is_left_out(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    write(ring, entry(1))
    ring.begin_segment()
    ring.close(ended=False)
    content = bytearray(ring.path.read_bytes())
    place = content.rindex((2).to_bytes(8, "little"))
    content[place : place + MARK.size] = b"\xff" * MARK.size
    ring.path.write_bytes(content)

    assert list(RingContent(ring.path).entries()) == [entry(1)]


def test_a_follower_of_a_ring_gets_each_entry_once_and_misses_what_was_overwritten(
    tmp_path: Path,
) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    tail = Tail(ring.path)
    followed = list(tail.new())
    for number in range(200):
        write(ring, entry(number))
        if number % 7 == 0:
            followed += tail.new()
    assert followed + tail.new() == [entry(number) for number in range(200)]
    assert tail.new() == []

    for number in range(200, 3000):
        write(ring, entry(number))
    late = tail.new()
    assert late == [entry(number) for number in range(3000 - len(late), 3000)]
    ring.close(ended=False)


def test_a_ring_that_cannot_be_followed_says_so(tmp_path: Path) -> None:
    ring = Ring(tmp_path, HEAD, SIZE)
    tail = Tail(ring.path)
    ring.path.unlink()
    ring.close(ended=False)
    with pytest.raises(RingError, match="cannot be followed"):
        tail.new()
