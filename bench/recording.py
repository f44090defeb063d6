"""Measure the cost of a ring, and the replay speed of a day's recording. A ring is the file on tmpfs
that holds a daemon's last minutes. A daemon without a ring is the baseline."""

import os
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from bench.daemons import Content, cost, daemon, memory_mb, shipped
from bench.figures import Row, Rows, Tables, compared
from bench.latency import daemon_paths
from bridges import __version__
from bridges.blackbox.entries import Head
from bridges.blackbox.recorder import Recorder
from bridges.blackbox.recordings import Recordings
from bridges.blackbox.ring import Ring
from bridges.kinds.lift import KIND
from bridges.kinds.lift.messages import state_message
from bridges.kinds.lift.signals import DoorReading, EndRequested, LiftRequested, LiftSample
from bridges.kinds.shared.decision import Sampled
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages.definitions import LiftRequest, Time
from bridges.messages.releases import JAZZY
from bridges.runtime.clock import Clock
from bridges.runtime.refusals import Refusals
from bridges.runtime.ring_writer import RingWriter
from bridges.runtime.subject import Subject, SubjectCore
from bridges.settings.load import load
from workbench.replay.bags import heard_in
from workbench.replay.files import opened
from workbench.replay.replayed import Replay, ReplayedCores, of_head
from workbench.replay.sources import Notes

ROUNDS, WATCHED_S = 2, 15.0
SCAN_S, DAY_S, RIDES = 0.05, 86400.0, 4000
RIDE_S = DAY_S / RIDES
WALL = 1_800_000_000.0
CONFIG = Path(__file__).parent.parent / "config/lift_dry_contact.yaml"


def measure(scratch: Path) -> Tables:
    """Measure an idle lift's daemon, alternately with and without a ring. Then measure its latencies,
    and a day of the lift at 20 Hz."""
    return {
        "a lift, left alone": _idle(scratch),
        "its paths, with a ring": _paths(scratch),
        f"a day of one lift, {RIDES} rides": {"recorded, read, replayed": _day(scratch)},
    }


def _keeping(keep: str) -> Content:
    return {**shipped("lift_dry_contact"), "recording": {"keep": keep}}


def _idle(scratch: Path) -> Rows:
    rows: dict[str, list[Row]] = {"nothing": [], "ring": []}
    for number in range(ROUNDS):
        for keep, found in rows.items():
            command = daemon(_keeping(keep), scratch / f"{keep}_{number}")
            found.append(cost(command, scratch / f"{keep}_{number}.log", WATCHED_S))
    means = {f"keep: {keep}": _mean(found) for keep, found in rows.items()}
    without, with_ring = means.values()
    more = {key: with_ring[key] - without[key] for key in ("RSS MB", "CPU %")}
    return {**means, "the ring": more}


def _mean(rows: list[Row]) -> Row:
    return {key: sum(row[key] for row in rows) / len(rows) for key in rows[0]}


def _paths(scratch: Path) -> Rows:
    """Compare three latencies with and without a ring: request to relay, input to RMF, and hazard to
    outputs off."""
    with_ring = daemon_paths(scratch, "dds", keep="ring")
    without = daemon_paths(scratch, "dds", keep="nothing")
    names = ("LiftRequest to relay edge", "input edge to LiftState", "hazard to all outputs off")
    return {name: compared(with_ring[n], without[n]) for n, name in enumerate(names)}  # type: ignore[arg-type]


def _day(scratch: Path) -> Row:
    """Record a whole day. Then read the messages, and replay all decisions."""
    began = time.perf_counter()
    Day(scratch).play()
    made_s = time.perf_counter() - began
    files = scratch / "recordings"
    before_mb = memory_mb(os.getpid())
    began = time.perf_counter()
    heard = sum(1 for _ in heard_in(files))
    read_s = time.perf_counter() - began
    head, entries = opened(files, Notes())
    replay = Replay(entries, ReplayedCores(of_head(head)))
    began = time.perf_counter()
    differences = len(list(replay.differences()))
    return {
        "made s": made_s,
        "MB": sum(file.stat().st_size for file in files.iterdir()) / 1e6,
        "messages": heard,
        "read s": read_s,
        "decisions": replay.course.decisions,
        "differences": differences,
        "replay s": time.perf_counter() - began,
        "more MB": memory_mb(os.getpid()) - before_mb,
    }


class Day:
    """A lift's day with 20 scans a second, in virtual time. A ring and a recorder record the lift."""

    def __init__(self, scratch: Path) -> None:
        self.now = 0.0
        config = load(CONFIG)
        self._settings = config.devices["Lift1"]
        limits = KIND.limits(self._settings, config.driver_type("Lift1").debounce(self._settings))
        keep = RecordingSettings(keep="continuous", files=10_000, files_mb=10_000)
        text = config.text
        head = Head("day", os.getpid(), __version__, "lift", str(CONFIG), text, {}, True, {}, keep)
        runtime = scratch / "runtime"
        runtime.mkdir()
        clock = Clock(lambda: self.now, lambda: WALL + self.now)
        make = partial(Ring, runtime, head, 1_000_000)
        self._writer = RingWriter(make, clock, lambda: JAZZY)
        recordings = Recordings(scratch / "recordings")
        self._recorder = Recorder(lambda: [runtime], recordings, lambda: self.now)
        core: SubjectCore[Any, Any, Any, Any] = SubjectCore(
            "device",
            lambda memory, event, now: KIND.decide(memory, event, now, limits),
            lambda report, now: {},
            lambda fault: fault,
        )
        memory = KIND.initial(limits, 0.0)
        self._lift = Subject(
            "Lift1", memory, core, lambda *_: None, Refusals(), clock, self._writer
        )

    def play(self) -> None:
        """Play the whole day."""
        for scan in range(int(DAY_S / SCAN_S)):
            self.now = scan * SCAN_S
            for event in events(self.now):
                self._lift.decide(event)
            if scan % 20 == 0:
                self._tell()
                self._recorder.look()
            self._writer.flush()
        self._recorder.close()

    def _tell(self) -> None:
        """Publish the state and RMF's repeated request each second."""
        assert self._lift.decision
        report = self._lift.decision.report
        state = state_message("Lift1", self._settings, report, Time(int(WALL + self.now)))
        self._writer.spoken("lift_states", state, sent=True)
        self._lift.published(KIND.published(self._lift.memory, report))
        if self.now % RIDE_S < 15.0:
            request = LiftRequest(
                "Lift1", Time(int(self.now)), "fleet/robot", 1, _floor(self.now), 2
            )
            self._writer.spoken("lift_requests", request, sent=False)


def _floor(now: float) -> str:
    return ("L1", "L3")[int(now / RIDE_S) % 2]


def events(now: float) -> Iterator[object]:
    """Yield the readings and requests of the lift at the time `now`. A ride begins every RIDE_S (s)."""
    into, before = now % RIDE_S, _floor(now - RIDE_S)
    agv = 0.5 < into < 16.0
    if into < 2.0:
        yield Sampled(LiftSample(before, DoorReading.CLOSED, agv=agv))
    elif into < 8.0:
        yield Sampled(LiftSample(None, DoorReading.CLOSED, agv=agv))
    elif into < 9.5 or 15.5 <= into < 17.0:
        yield Sampled(LiftSample(_floor(now), DoorReading.BETWEEN, agv=agv))
    elif into < 15.5:
        yield Sampled(LiftSample(_floor(now), DoorReading.OPEN, agv=agv))
    else:
        yield Sampled(LiftSample(_floor(now), DoorReading.CLOSED, agv=agv))
    if into < 15.0 and into % 1.0 < SCAN_S:
        yield LiftRequested("fleet/robot", True, _floor(now))
    elif 15.0 <= into < 15.0 + SCAN_S:
        yield EndRequested("fleet/robot")
