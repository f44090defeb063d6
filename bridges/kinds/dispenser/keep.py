"""The part of the memory of a dispenser or ingestor that is saved to disk: its requests with their
outcomes, and the failure that stops further cycles."""

from typing import Annotated, Final

import msgspec
from msgspec import Meta
from msgspec.structs import replace

from bridges.kinds.dispenser.memory import Job, Phase, WorkcellMemory
from bridges.kinds.dispenser.signals import Item
from bridges.kinds.shared import keep
from bridges.kinds.shared.keep import Text
from bridges.kinds.shared.kind import Keeping

VERSION: Final = 1
HOUR_S: Final = 3600.0
CUT_OFF: Final = "the daemon ended in the middle of the request's cycle"


class JobRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A Job without its times, because they mean nothing after a restart. `silent_h`: the hours for
    which RMF had been silent about the request."""

    guid: Text
    phase: Phase
    type_guid: str = ""
    quantity: Annotated[int, Meta(ge=0)] = 0
    compartment: str = ""
    transporter: str = ""
    why: str = ""
    closed: bool = False
    silent_h: Annotated[int, Meta(ge=0)] = 0


class KeptWorkcell(keep.Kept, frozen=True, forbid_unknown_fields=True):
    """The parts of WorkcellMemory that are saved to disk. `lost`: the reason why an earlier file is
    missing."""

    jobs: list[JobRecord]
    halted: str = ""
    lost: str = ""


def persist(memory: WorkcellMemory) -> bytes:
    """Encode the memory for the next start. The bytes change only when a part that is saved changes."""
    jobs = [_record(job) for job in memory.jobs]
    return msgspec.json.encode(KeptWorkcell(VERSION, jobs, memory.halted, memory.lost))


def restore(kept: bytes, now: float) -> WorkcellMemory:
    """Decode the memory. If a cycle was running, its outcome is unknown. Raises ValueError for bytes
    that `persist` did not make.

    The time for which RMF is silent about a request goes on at `now` (monotonic s) with the hours that
    were saved. The time for which the daemon was down does not count, because nobody knows it. No
    request counts as heard, so no cycle starts before RMF repeats its request.
    """
    found = keep.read(kept, KeptWorkcell, VERSION, "the memory of a dispenser or ingestor")
    jobs = tuple(_job(record, now) for record in found.jobs)
    if len({job.guid for job in jobs}) < len(jobs):
        raise ValueError("one request is in the memory twice")
    return WorkcellMemory(jobs=jobs, halted=found.halted, lost=found.lost)


def _record(job: Job) -> JobRecord:
    item = job.item
    return JobRecord(
        job.guid, job.phase, item.type_guid, item.quantity, item.compartment, job.transporter,
        job.why, job.closed, job.silent_h,
    )  # fmt: skip


def _job(record: JobRecord, now: float) -> Job:
    item = Item(record.type_guid, record.quantity, record.compartment)
    job = Job(record.guid, item, record.transporter, record.phase, record.why, record.phase)
    if record.phase == "running":
        return replace(job, phase="doubtful", why=CUT_OFF)
    if record.phase == "doubtful":
        return job
    return replace(
        job,
        closed=record.closed,
        heard=False,
        silent_h=record.silent_h,
        asked_at=now - record.silent_h * HOUR_S,
    )


KEEPING: Final[Keeping[WorkcellMemory]] = Keeping(
    part=lambda memory: (memory.jobs, memory.halted, memory.lost),
    persist=persist,
    restore=restore,
    lost=lambda reason: WorkcellMemory(lost=reason),
)
