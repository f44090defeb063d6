"""Single decisions of a dispenser's core.

The tests cover failures in the middle of a dispensing cycle, writes to the disk, and what a person
decides about a request in doubt.
"""

from collections.abc import Sequence
from typing import Any

import pytest
from msgspec.structs import replace

from bridges.kinds.dispenser import core
from bridges.kinds.dispenser.keep import persist, restore
from bridges.kinds.dispenser.memory import (
    Cycle,
    Job,
    WorkcellLimits,
    WorkcellMemory,
    WorkcellSenses,
    changes,
)
from bridges.kinds.dispenser.report import WorkcellReport
from bridges.kinds.dispenser.settings import WorkcellDurations, WorkcellSettings
from bridges.kinds.dispenser.signals import Item, ItemRequested, WorkcellOutputs, WorkcellSample
from bridges.kinds.shared.debounce import Settled
from bridges.kinds.shared.decision import (
    DecidedByPerson,
    IoFailed,
    MemoryKept,
    MemoryNotKept,
    OperatorReset,
    RivalSeen,
    Sampled,
    Suspended,
    WriteFailed,
)
from bridges.kinds.shared.durations import NEVER
from bridges.messages.constants import WorkcellMode
from bridges.messages.definitions import WorkcellStatus

BOX = Item("box", 1)
ASKS = ItemRequested("task", BOX, "fleet")
CALM = WorkcellSample(done=False, busy=False, ready=True, fault=False)
WORKS = replace(CALM, busy=True)
STEADY = WorkcellLimits(WorkcellDurations(cycle_limit_s=60.0))
PULSED = replace(STEADY, pulse_s=0.5)
ON = WorkcellOutputs(True, "task", BOX)
OFF = WorkcellOutputs(False, "task", BOX)


class Cell:
    """A dispenser's core that gets events. `refused` and `wake_at` come from the last decision."""

    def __init__(self, limits: WorkcellLimits = STEADY) -> None:
        self.limits = limits
        self.now = 0.0
        self.memory: WorkcellMemory = core.initial(limits, 0.0)
        self.outputs = WorkcellOutputs()
        self.report: WorkcellReport
        self.refused = ""
        self.wake_at = 0.0

    def take(self, *events: Any, at: float | None = None) -> "Cell":
        self.now = self.now if at is None else at
        for event in events:
            made = core.decide(self.memory, event, self.now, self.limits)
            assert made.wake_at > self.now
            self.memory, self.outputs, self.report = made.memory, made.outputs, made.report
            self.refused, self.wake_at = made.refused, made.wake_at
        return self

    @property
    def faults(self) -> Sequence[str]:
        return [str(fault) for fault in self.report.faults]


def asked(limits: WorkcellLimits = STEADY) -> Cell:
    """Return a dispenser whose core has decided to start a cycle. The start is not on the disk yet."""
    cell = Cell(limits).take(Sampled(CALM), at=10.0).take(ASKS, MemoryKept())
    assert (cell.outputs, cell.report.queue) == (WorkcellOutputs(), ("task",))
    return cell


def running(limits: WorkcellLimits = STEADY) -> Cell:
    """Return a dispenser whose cycle has begun at 10 s."""
    cell = asked(limits).take(MemoryKept())
    assert cell.outputs == ON
    return cell


# ---- DISPENSER-6: a failure in mid-cycle


@pytest.mark.parametrize("failure", [WriteFailed("no"), IoFailed("no"), Suspended("slept")])
def test_after_any_failure_in_mid_cycle_the_start_stays_off_and_done_still_counts(
    failure: Any,
) -> None:
    """DISPENSER-6."""
    cell = running().take(failure)
    assert cell.outputs == OFF
    assert cell.take(Sampled(WORKS), at=10.25).outputs == OFF
    assert cell.take(Sampled(replace(CALM, done=True)), at=11.0).outputs == WorkcellOutputs()
    assert cell.take(MemoryKept()).report.results == (("task", WorkcellStatus.SUCCESS),)


@pytest.mark.parametrize("failure", [WriteFailed("no"), IoFailed("no"), Suspended("slept")])
def test_a_failure_without_a_cycle_stops_nothing_and_its_reason_ends_with_a_reading(
    failure: Any,
) -> None:
    cell = Cell().take(Sampled(CALM), at=10.0).take(failure)
    assert (cell.memory.io_failure, cell.refused) == (str(failure.reason), "")
    assert cell.take(Sampled(CALM), at=10.25).memory.io_failure == ""


def test_a_suspended_daemon_knows_no_input_any_more() -> None:
    """DISPENSER-4: what was read before the daemon was suspended may be outdated."""
    cell = Cell().take(Sampled(CALM), at=10.0).take(Suspended("slept"))
    assert cell.faults == ["COMMUNICATION_LOST: slept"]
    assert cell.take(ASKS, MemoryKept(), MemoryKept()).outputs == WorkcellOutputs()


def test_a_failed_reading_restarts_the_debounce_of_each_input() -> None:
    """DISPENSER-4: after one failed reading a bounce of the contact must not count as `ready`."""
    limits = replace(STEADY, debounce={"ready": 0.5})
    cell = Cell(limits).take(Sampled(replace(CALM, ready=False)), at=10.0)
    cell.take(Sampled(replace(CALM, ready=False)), at=10.5)
    cell.take(Sampled(CALM), at=10.75).take(IoFailed("no"), at=11.0)
    cell.take(Sampled(CALM), at=11.25).take(ASKS, MemoryKept(), MemoryKept())
    assert cell.outputs == WorkcellOutputs()
    cell.take(Sampled(CALM), at=11.75).take(MemoryKept())
    assert cell.outputs == ON


def test_after_a_failed_reading_a_steady_input_counts_at_once() -> None:
    cell = Cell(replace(STEADY, debounce={"ready": 0.5})).take(Sampled(CALM), at=10.0)
    cell.take(Sampled(CALM), at=10.5).take(IoFailed("no"), at=10.6).take(Sampled(CALM), at=10.7)
    assert cell.take(ASKS, MemoryKept(), MemoryKept()).outputs == ON


# ---- DISPENSER-2: the core waits until a start is on the disk


def test_a_cycle_that_rmf_gave_up_before_its_start_was_on_disk_waits_again() -> None:
    """DISPENSER-2 and DISPENSER-4: RMF repeats a request within 5 s if it still wants the item."""
    cell = asked().take(MemoryNotKept("disk full"))
    assert (cell.outputs, cell.faults) == (
        WorkcellOutputs(), ["NOT_KEPT: nothing is accepted or started: disk full"],
    )  # fmt: skip
    cell.take(Sampled(CALM), at=15.0).take(MemoryKept())
    assert (cell.outputs, cell.memory.cycle, cell.faults) == (WorkcellOutputs(), None, [])
    assert cell.report.queue == ("task",)
    assert [(job.phase, job.kept) for job in cell.memory.jobs] == [("queued", "running")]
    cell.take(ASKS, MemoryKept(), MemoryKept())
    assert cell.outputs == ON


@pytest.mark.parametrize("now", [{"done": True}, {"ready": False}, {"busy": True}], ids=str)
def test_a_start_that_waited_for_the_disk_is_checked_again(now: dict[str, bool]) -> None:
    """DISPENSER-4."""
    cell = asked().take(MemoryNotKept("disk full"))
    cell.take(Sampled(replace(CALM, **now)), ASKS, at=14.0).take(MemoryKept())
    assert (cell.outputs.start, cell.report.queue) == (False, ("task",))
    cell.take(Sampled(CALM), ASKS, at=15.0).take(MemoryKept(), MemoryKept())
    assert cell.outputs == ON


def test_a_cycle_whose_start_comes_late_to_the_disk_has_its_whole_pulse_and_time() -> None:
    """DISPENSER-2: the pulse and the cycle's time limit begin when the start is on the disk."""
    cell = asked(PULSED).take(MemoryNotKept("disk full"))
    cell.take(Sampled(CALM), ASKS, at=14.0).take(MemoryKept())
    assert cell.outputs == ON
    assert cell.take(Sampled(WORKS), at=14.25).outputs == ON
    assert cell.take(Sampled(WORKS), at=14.5).outputs == OFF
    cell.take(Sampled(WORKS), at=73.75)
    assert cell.memory.cycle is not None
    cell.take(Sampled(WORKS), at=74.0).take(MemoryKept())
    assert cell.report.results == (("task", WorkcellStatus.FAILED),)


@pytest.mark.parametrize("failure", [WriteFailed("no"), IoFailed("no"), Suspended("slept")])
def test_a_failure_before_the_start_is_on_disk_does_not_cut_the_cycle(failure: Any) -> None:
    """DISPENSER-2 and DISPENSER-6: a cycle that is not on disk has not begun."""
    cell = asked().take(MemoryNotKept("disk full"), failure)
    cell.take(Sampled(CALM), ASKS, at=12.0).take(MemoryKept())
    assert cell.outputs == ON


def test_a_further_write_to_the_disk_does_not_prolong_the_pulse() -> None:
    cell = running(PULSED)
    cell.take(Sampled(WORKS), replace(ASKS, guid="other"), MemoryKept(), at=10.25)
    assert cell.take(Sampled(WORKS), at=10.5).outputs == OFF


def test_a_result_is_sent_once_for_each_request_of_rmf() -> None:
    """DISPENSER-1 and DISPENSER-3."""
    cell = running().take(replace(ASKS, guid="other"), MemoryKept())
    accepted = ("task", WorkcellStatus.ACKNOWLEDGED), ("other", WorkcellStatus.ACKNOWLEDGED)
    assert cell.report.results == accepted
    half = replace(cell.report, results=accepted[:1])
    cell.memory = core.published(cell.memory, half)
    assert cell.take(Sampled(CALM)).report.results == accepted[1:]
    cell.memory = core.published(cell.memory, cell.report)
    assert cell.take(Sampled(CALM)).report.results == ()
    assert cell.take(ASKS).report.results == accepted[:1]


def test_a_failure_is_sent_at_once_and_not_only_when_rmf_repeats_its_request() -> None:
    cell = running()
    cell.memory = core.published(cell.memory, cell.report)
    cell.take(Sampled(replace(CALM, fault=True)), MemoryKept(), at=11.0)
    assert cell.report.results == (("task", WorkcellStatus.FAILED),)


# ---- refused events, and decisions of a person


def test_no_event_but_a_wrong_request_or_decision_is_refused() -> None:
    events = (
        Sampled(CALM), Suspended("slept"), WriteFailed("no"), IoFailed("no"), RivalSeen(),
        OperatorReset(), MemoryKept(), MemoryNotKept("full"), ASKS,
    )  # fmt: skip
    assert [Cell().take(event, at=1.0).refused for event in events] == [""] * len(events)
    nothing = Cell().take(DecidedByPerson("done", ""), at=1.0)
    assert nothing.refused == "nothing in doubt: no request waits for a decision"
    other = asked().take(replace(ASKS, item=Item("jar", 1)))
    assert other.refused == "guid of another request: task is for 1 box"


def test_a_queue_of_a_hundred_requests_that_are_not_done_is_full() -> None:
    cases: list[tuple[Any, str]] = [
        ("done", ""),
        ("failed", "queue is full: 100 requests are not done"),
    ]
    for phase, refused in cases:
        jobs = tuple(Job(f"t{n}", phase=phase) for n in range(100))
        cell = Cell().take(Sampled(CALM), at=10.0)
        cell.memory = replace(cell.memory, jobs=jobs)
        assert cell.take(ASKS).refused == refused


def test_a_failure_halts_until_a_reset_and_no_longer() -> None:
    """DISPENSER-5."""
    cell = running().take(Sampled(replace(WORKS, fault=True)), MemoryKept(), at=11.0)
    assert cell.outputs == WorkcellOutputs()
    cell.take(Sampled(CALM), replace(ASKS, guid="next"), MemoryKept(), MemoryKept(), at=12.0)
    assert (cell.outputs, cell.report.waits) == (WorkcellOutputs(), "because of WORKCELL_HALTED")
    cell.take(OperatorReset(), MemoryKept())
    assert (cell.outputs.guid, cell.memory.halted) == ("next", "")


def test_a_restart_keeps_every_request_the_halt_and_the_lost_memory() -> None:
    item = Item("box", 3, "left")
    failed = Job("a", item, "fleet", "failed", "it jams", "failed", closed=True, silent_h=6)
    waits = Job("b", item, "other", "queued", kept="queued")
    before = WorkcellMemory(
        jobs=(failed, waits), halted="a has failed: it jams", lost="a full disk"
    )
    after = restore(persist(before), 7.0)
    silent = replace(failed, asked_at=7.0 - 6 * 3600.0, heard=False)
    asked_for = replace(waits, asked_at=7.0, heard=False)
    assert after == replace(before, jobs=(silent, asked_for))


def test_a_memory_of_an_earlier_version_has_no_silence() -> None:
    kept = persist(WorkcellMemory(jobs=(Job("a", kept="queued", silent_h=6),)))
    earlier = kept.replace(b',"silent_h":6', b"")
    assert earlier != kept
    [job] = restore(earlier, 7.0).jobs
    assert (job.silent_h, job.asked_at) == (0, 7.0)


def test_one_request_twice_in_the_memory_is_refused() -> None:
    twice = WorkcellMemory(jobs=(Job("a", kept="queued"), Job("a", kept="queued")))
    with pytest.raises(ValueError, match=r"^one request is in the memory twice$"):
        restore(persist(twice), 0.0)
    with pytest.raises(ValueError, match=r"^not the memory of a dispenser or ingestor: "):
        restore(b"[]", 0.0)


# ---- what people and RMF are told


def test_a_running_cycle_is_shown_as_busy_with_its_request_and_items() -> None:
    idle, busy = Cell().take(Sampled(CALM), at=10.0).report, running().report
    assert (idle.mode, idle.running, idle.item, idle.waits) == (WorkcellMode.IDLE, "", "", "")
    assert (busy.mode, busy.running, busy.item, busy.waits) == (
        WorkcellMode.BUSY, "task", "1 box", "",
    )  # fmt: skip


def test_each_obstacle_says_what_is_wrong() -> None:
    new = Cell().take(RivalSeen(), at=1.0)
    assert new.faults == [
        "TWO_NODES_FOR_ONE_DEVICE: another node publishes states of this workcell"
    ]
    assert new.take(RivalSeen(), at=6.0).take(MemoryKept(), at=11.0).faults == []
    assert new.report.mode == WorkcellMode.OFFLINE  # nothing has been read yet
    cell = Cell().take(Sampled(replace(CALM, errors=("a jam", "an open lid"))), at=10.0)
    assert cell.faults == ["WORKCELL_FAULT: a jam; an open lid"]
    assert cell.take(Sampled(replace(CALM, fault=True)), at=10.25).faults == [
        "WORKCELL_FAULT: its fault contact is on"
    ]
    assert cell.take(Sampled(CALM), at=10.5).take(MemoryKept(), at=11.5).faults == [
        "COMMUNICATION_LOST: no reading for 1.0 s"
    ]


def test_a_request_whose_inputs_bounce_says_so() -> None:
    cell = Cell(replace(STEADY, debounce={"ready": 0.5})).take(Sampled(CALM), at=10.0)
    assert cell.take(ASKS, MemoryKept()).report.waits == "for its inputs to be steady"
    assert cell.wake_at == 10.5


@pytest.mark.parametrize(("count", "more"), [(3, ""), (5, "; and 2 more")])
def test_requests_from_before_a_lost_memory_are_in_doubt_and_the_first_three_are_named(
    count: int, more: str
) -> None:
    cell = Cell().take(Sampled(CALM), at=10.0)
    cell.memory = replace(cell.memory, lost="a full disk")
    cell.take(*(replace(ASKS, guid=f"t{n}") for n in range(count)))
    why = "(1 box for fleet): asked for before this daemon remembers"
    decide = "decide: rmf-bridge workcell done, again or failed"
    assert cell.faults == [
        f"MEMORY_LOST: a full disk; {decide}",
        f"OUTCOME_UNKNOWN: t0 {why}; t1 {why}; t2 {why}{more}; look, then {decide}",
    ]


def test_a_finished_guid_that_comes_again_with_other_items_or_after_silence_is_in_doubt() -> None:
    for again, silent_s, why in (
        (Item("jar", 2), 1.0, "asked for 2 jar under the guid of a request for 1 box (done)"),
        (Item("jar", 2), 300.0, "asked for 2 jar under the guid of a request for 1 box (done)"),
        (BOX, 300.0, "done, and asked for again after RMF was silent for 300 s"),
    ):
        cell = running().take(Sampled(replace(CALM, done=True)), MemoryKept(), at=11.0)
        cell.take(Sampled(CALM), at=10.0 + silent_s)
        [job] = cell.take(replace(ASKS, item=again)).memory.jobs
        assert job == replace(
            job, phase="doubtful", item=again, why=why, asked_at=cell.now, due=True, closed=False
        )


@pytest.mark.parametrize(
    ("verdict", "phase", "why"),
    [
        ("done", "done", ""),
        ("again", "queued", ""),
        ("failed", "failed", "a person has decided so"),
    ],
)
def test_a_person_decides_one_request_or_all_with_the_lost_memory(
    verdict: Any, phase: Any, why: str
) -> None:
    doubts = tuple(Job(guid, BOX, phase="doubtful", why="?", asked_at=9.0) for guid in "ab")
    cell = Cell().take(Sampled(CALM), at=10.0)
    cell.memory = replace(cell.memory, jobs=doubts, lost="a full disk")
    decided = [replace(job, phase=phase, why=why, due=True) for job in doubts]
    cell.take(DecidedByPerson(verdict, "a"))
    assert (cell.memory.jobs, cell.memory.lost) == ((decided[0], doubts[1]), "a full disk")
    cell.take(DecidedByPerson(verdict, ""))
    assert (cell.memory.jobs, cell.memory.lost) == (tuple(decided), "")
    assert cell.refused == ""


def test_a_machine_that_stops_or_reports_a_fault_fails_with_the_reason() -> None:
    cell = running().take(Sampled(replace(WORKS, errors=("a jam", "an open lid"))), at=10.5)
    why = "it reports a fault: a jam; an open lid"
    assert (cell.memory.jobs[0].why, cell.memory.halted) == (why, f"task has failed: {why}")
    cell = running().take(Sampled(WORKS), at=10.5).take(Sampled(CALM), at=11.0)
    assert cell.take(Sampled(CALM), at=11.75).memory.cycle is not None
    assert cell.take(Sampled(CALM), at=12.0).memory.cycle is None
    assert cell.memory.jobs[0].why == "it has stopped, and done did not come within 1 s"


def test_a_finished_request_is_closed_after_silence_and_forgotten_after_a_day() -> None:
    phases: tuple[Any, ...] = ("done", "queued", "running", "failed", "doubtful")
    jobs = tuple(Job(phase, BOX, phase=phase, asked_at=0.0, due=True) for phase in phases)
    cell = Cell().take(Sampled(CALM), at=0.0)
    cell.memory = replace(cell.memory, jobs=jobs)
    closed = {"done": True, "failed": True}
    for now, known in ((299.5, phases), (300.0, phases), (86_400.0, ("running", "doubtful"))):
        cell.take(MemoryKept(), at=now)
        assert [job.guid for job in cell.memory.jobs] == [*known]
        assert [(job.closed, job.due) for job in cell.memory.jobs] == [
            (now >= 300.0 and closed.get(guid, False), now < 300.0 or guid not in closed)
            for guid in known
        ]


# ---- DISPENSER-8: requests that RMF has given up, over restarts


def restarted(cell: Cell) -> Cell:
    """Return the dispenser after a restart of its machine. The monotonic clock starts again."""
    new = Cell(cell.limits)
    new.memory = restore(persist(cell.memory), 0.0)
    return new.take(Sampled(CALM))


def test_requests_that_rmf_has_given_up_do_not_fill_the_queue_over_nightly_restarts() -> None:
    cell, never = Cell(), replace(CALM, ready=False)
    for day in range(130):
        cell.take(Sampled(never), replace(ASKS, guid=f"t{day}"), MemoryKept(), at=10.0)
        assert cell.refused == ""
        cell.take(Sampled(never), at=86_000.0)
        cell = restarted(cell)
    assert [job.guid for job in cell.memory.jobs] == ["t129"]


@pytest.mark.parametrize("phase", ["queued", "done", "failed"])
def test_the_day_of_a_silent_request_goes_on_after_restarts(phase: Any) -> None:
    cell = Cell().take(Sampled(CALM), at=0.0)
    cell.memory = replace(cell.memory, jobs=(Job("a", BOX, phase=phase, kept=phase, asked_at=0.0),))
    for _ in range(3):
        cell = restarted(cell.take(Sampled(CALM), at=7 * 3600.0))  # 6 h of each 7 h are saved
    cell.take(Sampled(CALM), at=6 * 3600.0 - 1)
    assert len(cell.memory.jobs) == 1
    assert cell.take(Sampled(CALM), at=6 * 3600.0).memory.jobs == ()


def test_a_request_from_before_a_restart_does_not_start_until_rmf_repeats_it() -> None:
    cell = restarted(Cell().take(Sampled(replace(CALM, ready=False)), ASKS, MemoryKept()))
    cell.take(MemoryKept(), MemoryKept())
    assert (cell.outputs, cell.report.queue) == (WorkcellOutputs(), ("task",))
    assert cell.take(ASKS, MemoryKept(), MemoryKept()).outputs == ON


def test_a_silence_that_rmf_ends_counts_no_more() -> None:
    cell = Cell().take(Sampled(replace(CALM, ready=False)), ASKS, MemoryKept(), at=0.0)
    assert cell.take(Sampled(CALM), at=4 * 3600.0).memory.jobs[0].silent_h == 3
    assert cell.take(ASKS).memory.jobs[0].silent_h == 0


@pytest.mark.parametrize("verdict", ["done", "failed", "again"])
def test_a_request_that_a_person_decided_after_a_restart_is_forgotten_too(verdict: Any) -> None:
    cell = restarted(running()).take(DecidedByPerson(verdict, ""), Sampled(CALM), at=10.0)
    cell.take(MemoryKept(), MemoryKept())  # RMF does not repeat the request, so nothing starts
    assert cell.outputs == WorkcellOutputs()
    assert cell.take(Sampled(CALM), at=86_410.0).memory.jobs == ()


def test_of_the_finished_requests_the_last_thousand_are_remembered() -> None:
    jobs = [Job(f"t{n}", phase="done", kept="done", asked_at=0.0) for n in range(core.MOST_CLOSED)]
    cell = Cell().take(Sampled(CALM), at=300.0)
    cell.memory = replace(cell.memory, jobs=(*jobs, Job("last", phase="done", asked_at=0.0)))
    cell.take(Sampled(CALM))
    assert [job.guid for job in cell.memory.jobs] == [*(job.guid for job in jobs[1:]), "last"]


# ---- the times at which the core decides again


def test_the_core_wakes_for_each_of_its_time_limits() -> None:
    contact = Settled(value=False, candidate=True, since=10.25, torn_since=10.0)
    steady = Settled(value=False, candidate=False, since=1.0, steady_at=1.0)
    memory = WorkcellMemory(
        jobs=(
            Job("a", phase="done", asked_at=20.0),
            Job("b", phase="failed", asked_at=30.0, closed=True),
            Job("c", phase="queued", asked_at=40.0),
            Job("d", phase="done"),
        ),
        cycle=Cycle("c", 100.0, rested_at=200.0),
        senses=WorkcellSenses(steady, steady, contact, contact, read_at=11.0),
        rival_at=50.0,
    )
    limits = replace(PULSED, debounce={"ready": 0.5})
    assert sorted(at for at in changes(memory, limits) if at < NEVER) == [
        10.25,  # the fault contact, without a debounce
        10.75,  # ready
        12.0,  # the reading is stale
        55.0,  # the rival is gone
        100.5,  # the pulse ends
        160.0,  # the cycle's time is over
        201.0,  # done has not come
        320.0,  # request a is closed
    ]


def test_the_limits_are_those_of_the_file() -> None:
    limits = WorkcellDurations(cycle_limit_s=60.0)
    settings = WorkcellSettings(limits=limits, pulse_s=2.0)
    assert WorkcellLimits.of(settings, {"done": 0.1}) == WorkcellLimits(limits, {"done": 0.1}, 2.0)
