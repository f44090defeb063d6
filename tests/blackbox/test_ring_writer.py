"""The writer of rings, which are files with a daemon's latest messages and decisions. An error of the
ring disturbs no scan. The ring holds only true entries."""

import errno
import os
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from bridges.blackbox.entries import (
    AnyEntry,
    Clocks,
    Decided,
    EntriesLost,
    Head,
    Known,
    Same,
    Spoken,
)
from bridges.blackbox.incident import Incident, timed
from bridges.blackbox.mcap_write import write
from bridges.blackbox.ring import Ring, RingContent
from bridges.kinds.lift.signals import DoorReading, LiftOutputs, LiftSample
from bridges.kinds.shared.decision import Decision, Sampled
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages.definitions import LiftState, Message
from bridges.messages.releases import KILTED
from bridges.runtime.clock import Clock
from bridges.runtime.ring_writer import RingWriter
from tests.blackbox.test_recorder import REPORT, WALL
from workbench.replay.bags import heard_in
from workbench.replay.replayed import times

HEAD = Head("r", 1, "1", "lift", "/l.yaml", b"", {}, False, {}, RecordingSettings())


class Daemon:
    """A stand-in for the part of a daemon that gives events to the writer, in virtual time."""

    def __init__(self, folder: Path, make: Callable[[], Ring] | None = None) -> None:
        self.now, self.step_s = 100.0, 0.0
        self.folder = folder
        clock = Clock(lambda: self.now, lambda: WALL + self.now + self.step_s)
        self.writer = RingWriter(make or self.ring, clock, lambda: KILTED)
        self.memory: object = None

    def ring(self) -> Ring:
        return Ring(self.folder, HEAD, 100_000)

    def scan(self, door: DoorReading = DoorReading.CLOSED, memory: object = None) -> None:
        """Record a reading and the decision on it."""
        decision = Decision(memory, LiftOutputs(), REPORT, NEVER)
        sample = Sampled(LiftSample("L1", door))
        self.writer.decided("Lift1", self.memory, sample, self.now, decision)
        self.memory = memory
        self.writer.flush()

    def say(self, message: Message) -> None:
        self.writer.spoken("lift_states", message, sent=True)
        self.writer.flush()

    def entries(self) -> list[AnyEntry]:
        return list(RingContent(self.folder / "ring").entries())


def test_unchanged_readings_cost_one_timestamp_each_and_none_is_lost(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    scanned: list[float] = []
    for _ in range(90):
        daemon.now += 0.05
        daemon.scan(DoorReading.OPEN if len(scanned) == 50 else DoorReading.CLOSED)
        scanned.append(daemon.now)
    daemon.writer.ended(safe=True)

    found = daemon.entries()
    steps = [one for one in found if isinstance(one, Decided)]
    read = [t for one in found if isinstance(one, Same) for t in times(one)]
    assert [one.at for one in steps] == [scanned[0], scanned[50], scanned[51]]
    assert sorted([*read, *(one.at for one in steps)]) == scanned
    assert len(found) < 20


def test_the_whole_memory_is_written_each_minute_and_when_it_is_not_what_was_decided(
    tmp_path: Path,
) -> None:
    daemon = Daemon(tmp_path)
    for _ in range(130):
        daemon.now += 1.0
        daemon.scan()
    daemon.memory = "another"
    daemon.scan()

    known = [(one.at, one.anew) for one in daemon.entries() if isinstance(one, Known)]
    assert known == [(101.0, True), (160.0, False), (220.0, False), (230.0, True)]


def test_a_step_of_the_wall_clock_is_recorded_and_recorded_time_never_goes_back(
    tmp_path: Path,
) -> None:
    daemon = Daemon(tmp_path)
    for step_s in (0.0, 0.0, -3600.0, -3600.0, 0.01):
        daemon.now += 1.0
        daemon.step_s = step_s
        daemon.say(LiftState(lift_name="Lift1"))
    entries = daemon.entries()
    write(tmp_path / "a.mcap", Incident(HEAD, entries))

    heard = list(heard_in(tmp_path / "a.mcap"))
    assert list(heard_in(tmp_path / "ring")) == heard
    assert [round(one.wall - WALL, 3) for one in heard] == [101, 102, -3497, -3496, 105.01]
    assert [round(one.at - WALL, 3) for one in heard] == [101, 102, 103, 104, 105]
    assert len([one for one in entries if isinstance(one, Clocks)]) == 3
    assert [steady for _, steady, _ in timed(entries)] == sorted(s for _, s, _ in timed(entries))


def test_without_room_for_a_ring_the_writer_reports_it_once_and_tries_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    full = [True]

    def make() -> Ring:
        if full[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return Ring(tmp_path, HEAD, 100_000)

    daemon = Daemon(tmp_path, make)
    for _ in range(60):
        daemon.now += 1.0
        daemon.scan()
        daemon.writer.look()
    assert not (tmp_path / "ring").exists()
    full[0] = False
    for _ in range(11):
        daemon.now += 1.0
        daemon.writer.look()
        daemon.scan()

    assert [r.getMessage().split(" ")[0] for r in caplog.records] == ["not_written"]
    assert [type(one) for one in daemon.entries()][:3] == [Clocks, Known, Decided]


def test_a_write_that_fails_ends_no_scan_and_the_next_ring_begins_afresh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    daemon = Daemon(tmp_path)
    daemon.scan()

    def fail(*_: object) -> int:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as broken:
        broken.setattr(os, "pwrite", fail)
        daemon.now += 1.0
        daemon.scan(DoorReading.OPEN)
    for _ in range(12):
        daemon.now += 1.0
        daemon.writer.look()
        daemon.scan()

    assert [type(one) for one in daemon.entries()][:3] == [Clocks, Known, Decided]


def test_what_cannot_be_recorded_is_lost_and_no_scan_with_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    daemon = Daemon(tmp_path)
    for _ in range(3):
        daemon.memory = object()  # a defect of the program: no core returns such an object
        daemon.scan()

    assert [r.getMessage().split(" ")[0] for r in caplog.records] == ["not_written"]


def test_a_message_larger_than_a_segment_is_counted_as_lost(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    daemon.say(LiftState(lift_name="L" * 200_000))
    daemon.say(LiftState(lift_name="Lift1"))

    found = daemon.entries()
    assert [one.number for one in found if isinstance(one, EntriesLost)] == [1]
    assert len([one for one in found if isinstance(one, Spoken)]) == 1


def test_a_flood_takes_no_more_than_its_bound_and_each_decision_is_kept(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    for _ in range(5):
        daemon.now += 1.0
        for _ in range(10_000):
            daemon.writer.spoken("lift_states", LiftState(), sent=True)
        daemon.scan(DoorReading.OPEN if daemon.now % 2 else DoorReading.CLOSED)
    daemon.now += 1.0
    daemon.say(LiftState())

    found = daemon.entries()  # the many messages fill the ring, so only the last seconds remain
    kept = Counter(one.at for one in found if isinstance(one, Spoken))
    assert [kept[at] for at in (104.0, 105.0, 106.0)] == [200, 200, 1]
    assert {one.number for one in found if isinstance(one, EntriesLost)} == {9_800}
    assert [one.at for one in found if isinstance(one, Decided)][-2:] == [104.0, 105.0]


def test_a_ring_that_failed_is_not_taken_for_a_run_that_died(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path)
    daemon.memory = object()  # a defect of the program
    daemon.scan()
    daemon.now += 11.0
    daemon.writer.look()

    assert (tmp_path / "ring").exists()
    assert not (tmp_path / "ring.died").exists()
