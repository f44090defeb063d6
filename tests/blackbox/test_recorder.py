"""The recorder: its reasons to write a file, the content of the file, and the number of kept files."""

import os
import re
from collections.abc import Callable
from datetime import date
from functools import partial
from pathlib import Path

import pytest
from msgspec.structs import replace

from bridges.blackbox import recordings as stored
from bridges.blackbox.entries import Decided, Head
from bridges.blackbox.recorder import Recorder
from bridges.blackbox.recordings import Named, Recordings, Stored, least_valuable_first, reason
from bridges.blackbox.ring import DIED, Ring, RingContent
from bridges.kinds.lift.report import LiftReport
from bridges.kinds.lift.signals import DoorReading, LiftOutputs, LiftRequested, LiftSample
from bridges.kinds.shared.decision import Decision, Fault, IoFailed, OperatorReset, Sampled
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages.definitions import (
    LiftDoor,
    LiftMode,
    LiftMotion,
    LiftRequest,
    LiftState,
    Message,
)
from bridges.messages.releases import KILTED
from bridges.runtime.clock import Clock
from bridges.runtime.ring_writer import RingWriter
from workbench.replay.bags import Notes, heard_in
from workbench.replay.incidents import entries_in, head_of, notes_in

WALL = 1_700_000_000.0
REPORT = LiftReport(
    0.0, "L1", "", LiftDoor.DOOR_CLOSED, LiftMotion.MOTION_STOPPED, LiftMode.MODE_HUMAN, ""
)
SAMPLE = Sampled(LiftSample("L1", DoorReading.CLOSED))


class Machine:
    """A machine with one daemon and a recorder, in virtual time."""

    def __init__(self, folder: Path, keep: RecordingSettings = RecordingSettings()) -> None:  # noqa: B008
        self.now = 1000.0
        self.day = date(2026, 11, 24)
        self.pid = os.getpid()
        self.keep = keep
        self.runtime = folder / "run" / "lift1"
        self.runtime.mkdir(parents=True)
        self.out = folder / "out"
        self.recorder = Recorder(
            lambda: [self.runtime], Recordings(self.out), lambda: self.now, lambda: self.day
        )
        self.runs = 0
        self.start()

    def start(self) -> None:
        """Start a daemon."""
        self.runs += 1
        head = Head(
            f"{self.runs:08x}",
            self.pid,
            "1",
            "lift",
            "/etc/lift1.yaml",
            b"",
            {},
            False,
            {},
            self.keep,
        )
        make = partial(Ring, self.runtime, head, 200_000)
        clock = Clock(lambda: self.now, lambda: WALL + self.now)
        self.writer = RingWriter(make, clock, lambda: KILTED)
        self.memory = object()
        self.decide(SAMPLE)

    def decide(self, event: object, refused: str = "", *faults: Fault) -> None:
        """Record a decision of the daemon in the ring."""
        report = replace(REPORT, faults=faults)
        decision = Decision(None, LiftOutputs(), report, NEVER, refused)
        self.writer.decided("Lift1", None, event, self.now, decision)
        self.writer.flush()

    def say(self, topic: str, message: Message, *, sent: bool = False) -> None:
        """Record a message in the ring. With `sent` the daemon has sent the message."""
        self.writer.spoken(topic, message, sent=sent)
        self.writer.flush()

    def live(self, seconds: int, each: Callable[[], None] = lambda: None) -> None:
        """Let time pass. Each second the daemon decides on a reading, and then the recorder checks the
        ring."""
        for _ in range(seconds):
            self.now += 1.0
            self.decide(SAMPLE)
            each()
            self.writer.look()
            self.recorder.look()

    def files(self) -> list[str]:
        """Return the names of the recordings."""
        return sorted(path.name for path in self.out.glob("*"))

    def only(self) -> Path:
        """Return the only recording."""
        [path] = self.out.glob("*.mcap")
        return path


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def reasons(path: Path) -> list[tuple[str, str, str]]:
    return [(note.code, note.subject, note.text) for note in notes_in(path)]


def test_while_all_is_well_nothing_is_written(machine: Machine) -> None:
    machine.live(300, lambda: machine.say("lift_states", LiftState(lift_name="Lift1"), sent=True))

    assert machine.files() == []


def test_a_fault_makes_one_file_with_what_went_before_and_what_followed(machine: Machine) -> None:
    def state() -> None:
        machine.say("lift_states", LiftState(lift_name="Lift1"), sent=True)

    machine.live(200, state)
    machine.decide(SAMPLE, "", Fault("FIRE"))
    machine.live(31, state)
    assert machine.files() == []
    machine.live(2, state)

    path = machine.only()
    assert path.name.endswith("_fault-fire_00000001.mcap")
    assert reasons(path) == [("FAULT", "Lift1", "FIRE")]
    assert head_of(path).run == "00000001"
    times = [one.wall - WALL for one in heard_in(path)]
    assert 1000 + 200 - 120 - 61 <= times[0] <= 1000 + 200 - 120
    assert times[-1] == 1000 + 200 + 30
    assert len(list(entries_in(path, Notes()))) > 5


@pytest.mark.parametrize(
    ("happens", "why"),
    [
        (lambda m: m.decide(LiftRequested("r2", True, "L3"), "busy: r1 rides"), "REFUSED"),
        (lambda m: m.decide(IoFailed("no answer"), "", Fault("INPUTS_NOT_FRESH")), "FAULT"),
        (lambda m: m.decide(SAMPLE, "released a moment ago"), None),
        (lambda m: m.decide(OperatorReset(), "no error to clear"), None),
        (lambda m: m.decide(IoFailed("no answer")), None),
    ],
    ids=["refused", "fault", "handover", "needless reset", "one failed reading"],
)
def test_refusals_and_faults_are_reasons_for_a_recording_and_handovers_are_not(
    machine: Machine, happens: Callable[[Machine], None], why: str | None
) -> None:
    happens(machine)
    machine.live(40)

    assert [name.split("_")[-2].split("-")[0] for name in machine.files()] == (
        [why.lower()] if why else []
    )


def test_the_same_cause_makes_no_second_file_within_ten_minutes(machine: Machine) -> None:
    for _ in range(8):
        machine.decide(SAMPLE, "", Fault("DOOR_STUCK", "a"))
        machine.live(60)
    assert len(machine.files()) == 1
    machine.live(200)
    machine.decide(SAMPLE, "", Fault("DOOR_STUCK", "b"))
    machine.live(60)
    assert len(machine.files()) == 2


def test_a_robot_that_waits_too_long_for_a_lift_makes_a_file_and_a_served_one_does_not(
    machine: Machine,
) -> None:
    asked = LiftRequest("Lift1", session_id="r1", request_type=1, destination_floor="L3")
    there = LiftState(lift_name="Lift1", current_floor="L3", session_id="r1", door_state=2)
    machine.live(150, lambda: machine.say("lift_requests", asked))
    machine.say("lift_states", there, sent=True)
    machine.live(150, lambda: machine.say("lift_requests", asked))
    assert machine.files() == []
    machine.live(70, lambda: machine.say("lift_requests", asked))

    assert reasons(machine.only()) == [("WAITING", "Lift1", "r1 has waited for L3 for 180 s")]
    assert len(list(heard_in(machine.only()))) > 100


def test_a_request_that_is_no_longer_repeated_counts_as_waiting_no_longer(machine: Machine) -> None:
    asked = LiftRequest("Lift1", session_id="r1", request_type=1, destination_floor="L3")
    machine.live(100, lambda: machine.say("lift_requests", asked))
    machine.live(20)
    machine.live(120, lambda: machine.say("lift_requests", asked))

    assert machine.files() == []


def test_a_killed_run_is_recorded_once_even_if_the_recorder_restarts(
    machine: Machine,
) -> None:
    machine.live(50)
    machine.start()
    machine.live(5)
    machine.recorder = Recorder(
        lambda: [machine.runtime], Recordings(machine.out), lambda: machine.now
    )
    machine.live(5)

    assert reasons(machine.only()) == [
        ("DIED", "", "the daemon left no last entry: it was killed, or the machine stopped")
    ]
    assert head_of(machine.only()).run == "00000001"


def test_a_run_that_a_defect_ended_is_recorded_with_its_reason(machine: Machine) -> None:
    machine.live(10)
    machine.writer.died("bus-io: ZeroDivisionError")
    machine.writer.ended(safe=True)
    machine.pid = 2**22 + 1
    machine.start()
    machine.live(40)

    assert [r for name in machine.files() for r in reasons(machine.out / name)][:1] == [
        ("DIED", "", "bus-io: ZeroDivisionError")
    ]


def test_a_daemon_that_dies_again_and_again_makes_one_file_in_ten_minutes(
    machine: Machine,
) -> None:
    for _ in range(20):
        machine.live(3)
        machine.start()
    assert len(machine.files()) == 1
    machine.live(600)
    machine.start()
    machine.live(3)
    assert len(machine.files()) == 2


def test_a_start_that_fails_makes_no_recording(machine: Machine) -> None:
    machine.writer.ended(safe=True)
    head = RingContent(machine.runtime / "ring").head
    for number in range(3):
        Ring(machine.runtime, replace(head, run=f"f{number}"), 200_000).close(ended=False)
        machine.live(3)

    assert machine.files() == []


def test_a_run_that_ended_in_good_order_is_not_recorded(machine: Machine) -> None:
    machine.live(10)
    machine.writer.ended(safe=True)
    machine.start()
    machine.live(40)

    assert machine.files() == []
    assert not (machine.runtime / DIED).exists()


def test_a_daemon_that_ends_before_the_30_s_are_over_is_recorded_up_to_its_end(
    machine: Machine,
) -> None:
    machine.live(20)
    machine.decide(SAMPLE, "", Fault("FIRE"))
    machine.live(5)
    machine.writer.ended(safe=True)
    (machine.runtime / "ring").unlink()
    machine.recorder.look()

    assert reasons(machine.only()) == [("FAULT", "Lift1", "FIRE")]


def test_all_daemons_of_a_machine_share_one_bound_and_the_largest_in_a_yaml_counts(
    tmp_path: Path,
) -> None:
    machine = Machine(tmp_path, RecordingSettings(files=3))
    machine.out.mkdir()
    (machine.out / "a_persons_own.mcap").touch()
    others = [
        "door_2026-01-01_00-00-00_waiting_abcdefab.mcap",
        "door_2026-01-02_00-00-00_waiting_abcdefab.mcap",
    ]
    for name in others:
        (machine.out / name).touch()
    for _ in range(2):
        machine.decide(SAMPLE, "", Fault("FIRE"))
        machine.live(700)
        machine.decide(SAMPLE)
        machine.live(1)

    first, again = [name for name in machine.files() if name.startswith("lift1")]
    assert ["_fault-fire_" in name for name in (first, again)] == [True, True]
    assert machine.files() == sorted(["a_persons_own.mcap", others[0], first, again])
    assert Recordings(machine.out).has_death(head_of(machine.out / first)) is False


def file(name: str, at: float, size: int = 1) -> Stored:
    """Return a stored file. `name` is `<daemon> <reason>`."""
    daemon, why = name.split(" ")
    return Stored(Path(f"{daemon}_{why}_{at:.0f}"), Named(at, daemon, why), size)


def removed(*files: Stored, now: float = 1000.0) -> list[str]:
    return [one.path.name for one in least_valuable_first(files, now)]


def test_repeats_of_a_flapping_fault_go_before_deaths_and_first_occurrences() -> None:
    flapping = [file("lift fault-offline", at) for at in range(10, 50, 10)]
    death, once = file("lift died", 5), file("door refused-malformed", 1)

    assert removed(death, *flapping, once) == [
        "lift_fault-offline_20",
        "lift_fault-offline_30",
        "lift_fault-offline_40",
        "door_refused-malformed_1",
        "lift_fault-offline_10",
        "lift_died_5",
    ]


def test_files_of_everything_go_before_every_incident() -> None:
    everything = [file("lift all", at) for at in (500, 600)]

    assert removed(file("lift fault-fire", 1), file("lift fault-fire", 2), *everything) == [
        "lift_all_500",
        "lift_all_600",
        "lift_fault-fire_2",
        "lift_fault-fire_1",
    ]


def test_a_file_from_the_future_counts_as_the_oldest_so_that_new_files_stay() -> None:
    by_wrong_clock = [file("lift fault-fire", at) for at in (9000, 9001, 9002)]
    new = [file("lift fault-fire", at) for at in (998, 999)]

    assert removed(*new, *by_wrong_clock) == [
        "lift_fault-fire_9001",
        "lift_fault-fire_9002",
        "lift_fault-fire_998",
        "lift_fault-fire_999",
        "lift_fault-fire_9000",
    ]


@pytest.mark.parametrize(
    ("code", "text", "named"),
    [
        ("FAULT", "DOOR_STUCK: no end for 10 s", "fault-door-stuck"),
        ("REFUSED", "unknown floor: L9", "refused-unknown-floor"),
        ("REFUSED", "../" * 30 + "L9", "refused"),
        ("WAITING", "fleet/r1 has waited for L3 for 181 s", "waiting"),
        ("DIED", "the daemon left no last entry", "died"),
    ],
)
def test_a_files_name_has_the_reason_and_nothing_from_the_network(
    code: str, text: str, named: str
) -> None:
    assert reason(code, text).startswith(named)
    assert re.fullmatch("[a-z0-9-]{1,60}", reason(code, text))


def test_a_full_disk_loses_recordings_and_is_logged_once(
    machine: Machine, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(stored, "LEAST_FREE", 1 << 62)
    for number in range(3):
        machine.decide(SAMPLE, "", Fault(f"F{number}"))
        machine.live(40)

    assert machine.files() == []
    assert [r.getMessage().split(" ")[0] for r in caplog.records] == ["not_recorded"]


def test_continuous_files_follow_each_other_without_gap_or_overlap(tmp_path: Path) -> None:
    machine = Machine(tmp_path, RecordingSettings(keep="continuous"))
    machine.live(1000, lambda: machine.say("lift_states", LiftState(), sent=True))
    machine.recorder.close()

    spoken = [one.at for name in machine.files() for one in heard_in(machine.out / name)]
    assert len(machine.files()) == 4
    assert len(spoken) == 1000
    assert spoken == sorted(set(spoken))
    assert {name.split("_")[-2] for name in machine.files()} == {"all"}


def test_a_damaged_ring_keeps_no_other_from_being_recorded(
    machine: Machine, tmp_path: Path
) -> None:
    broken = tmp_path / "run" / "broken"
    broken.mkdir()
    (broken / "ring").write_bytes(b"RMFRING1" + b"\xff" * 9000)
    (broken / DIED).write_bytes(b"")
    folders = [broken, machine.runtime, tmp_path / "none"]
    machine.recorder = Recorder(lambda: folders, Recordings(machine.out), lambda: machine.now)
    machine.decide(SAMPLE, "", Fault("FIRE"))
    machine.live(40)

    assert reasons(machine.only()) == [("FAULT", "Lift1", "FIRE")]


def test_the_ring_shows_each_decision_of_the_machine(machine: Machine) -> None:
    machine.live(3)
    steps = [e for e in RingContent(machine.runtime / "ring").entries() if isinstance(e, Decided)]
    assert len(steps) == 1
