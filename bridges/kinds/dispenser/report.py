"""The report of a dispenser or ingestor to RMF, the log and the status file."""

from collections.abc import Iterator

import msgspec

from bridges.kinds.dispenser.memory import (
    Job,
    WorkcellLimits,
    WorkcellMemory,
    obstacles,
)
from bridges.kinds.shared.decision import Fault
from bridges.messages.constants import WorkcellMode, WorkcellStatus


class WorkcellReport(msgspec.Struct, frozen=True):
    """The state for RMF and the status file. `queue`: the guids of the listed requests. `results`: a
    pair of guid and result for each request that waits for a result. A state with `queue` is
    published before these results.

    `running`: the guid of the running cycle. `item`: the content of that request. `start`: the output
    `start` may be on. `waits`: the reason why the next request does not run.
    """

    mode: WorkcellMode
    queue: tuple[str, ...] = ()
    results: tuple[tuple[str, WorkcellStatus], ...] = ()
    read_at: float | None = None
    faults: tuple[Fault, ...] = ()
    running: str = ""
    item: str = ""
    waits: str = ""

    def news(self) -> object:
        """Return the report without its age, without results, and without texts that RMF does not
        see."""
        return self.mode, self.queue, self.faults, self.running


def report(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellReport:
    """Report the present state, as far as it is on disk.

    If the memory is lost, the state has no time and an empty queue, and RMF ignores it. With a time,
    RMF would assume that every request is done that the state does not list.
    """
    runs = memory.running()
    read_at = None if memory.lost else memory.senses.read_at
    listed = [job for job in memory.jobs if job.is_listed and read_at is not None]
    return WorkcellReport(
        mode=_mode(memory, runs is not None, now, limits),
        queue=tuple(job.guid for job in listed),
        results=tuple(_results(memory, listed)),
        read_at=read_at,
        faults=tuple(_faults(memory, now, limits)),
        running=runs.guid if runs else "",
        item=str(runs.item) if runs else "",
        waits=_waits(memory, now, limits),
    )


def _mode(memory: WorkcellMemory, runs: bool, now: float, limits: WorkcellLimits) -> WorkcellMode:
    if any(obstacles(memory, now, limits)):
        return WorkcellMode.OFFLINE
    return WorkcellMode.BUSY if runs else WorkcellMode.IDLE


def _results(memory: WorkcellMemory, listed: list[Job]) -> Iterator[tuple[str, WorkcellStatus]]:
    for job in memory.jobs:
        if not job.due or memory.not_kept:
            continue
        match job.kept, job.phase:
            case "done", "done":
                yield job.guid, WorkcellStatus.SUCCESS
            case "failed", "failed":
                yield job.guid, WorkcellStatus.FAILED
            case "queued" | "running", "queued" | "running" if job in listed:
                yield job.guid, WorkcellStatus.ACKNOWLEDGED


def _faults(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> Iterator[Fault]:
    never_tried = memory.senses.read_at is None and not memory.io_failure
    for fault in obstacles(memory, now, limits):
        if fault.code != "COMMUNICATION_LOST" or not never_tried:
            yield fault


def _waits(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> str:
    """Return the reason why no cycle runs although a request waits; "" if there is none."""
    queued = [job for job in memory.jobs if job.phase == "queued"]
    if memory.cycle is not None or not (queued or memory.doubtful()):
        return ""
    found = next(iter(obstacles(memory, now, limits)), None)
    if found:
        return f"because of {found.code}"
    senses = memory.senses
    if not senses.seen():
        return "for its inputs to be steady"
    if not senses.is_off("done"):
        return "for done of the last cycle to end"
    if senses.is_off("ready") or senses.is_on("busy"):
        return "for the workcell to be ready"
    return "for RMF to repeat the request"
