"""The decision core of a dispenser or ingestor: one pure decision for each event.

How RMF treats a dispenser or ingestor is in rmf_ros2 9dedd0f, phases/DispenseItem.cpp and
IngestItem.cpp. The fleet adapter repeats its request each second, without a stamp and without end. A
result SUCCESS completes the request. A state can complete the request too. It does so if it no longer
lists the request, and if an earlier state listed the request or a result acknowledged it. So if a node
forgets a request, or stops listing a failed request, RMF sends the robot away unloaded.

Rules:
DISPENSER-1. One guid is one cycle, however often RMF repeats the request. If RMF requests the guid of a
   finished request again, that request's result is sent again.
DISPENSER-2. A request is first written to disk, then listed in a newer state, then acknowledged. A
   cycle and its outcome are also on disk before an output or a message shows them.
DISPENSER-3. A request stays listed until it is recorded as done on the disk. A failed request stays
   listed, because RMF may not have heard its result.
DISPENSER-4. One cycle runs at a time, in the order of the requests. A cycle starts only if RMF still
   repeats its request, the inputs are fresh, `done` is off, `ready` is on or not wired, and nothing
   else forbids the start.
DISPENSER-5. A cycle that ends with `done` is a SUCCESS. A cycle has FAILED in three cases: a fault is
   reported; `busy` has been over for `settle_s` without `done`; `cycle_limit_s` has passed. The outputs
   then go off at once. After a failure no cycle starts before an operator's reset.
DISPENSER-6. After a failed read or write, and when `busy` is over without `done`, the output `start`
   goes off. It stays off until the cycle ends. Otherwise a controller that restarts could take a
   `start` that is still on for another request. `done` may still come until the limit.
DISPENSER-7. The outcome is in doubt in these cases: the daemon has died in mid-cycle; the memory on
   disk is lost; a guid comes again with other items; a guid comes again after `repeats_within_s` of
   silence. Then the state is OFFLINE, no cycle starts, and the request gets no result until a person
   decides. If the memory is lost, or nothing has been read yet, the state has the stamp 0 and an empty
   queue. RMF ignores a state with the stamp 0.
DISPENSER-8. A request is forgotten a day after RMF's last request for it, unless its cycle runs or its
   outcome is in doubt. After a restart the day goes on. Of the finished requests about which RMF is
   silent only the last MOST_CLOSED are remembered.
"""

import itertools
from typing import Final

from msgspec.structs import replace

from bridges.kinds.dispenser.memory import (
    SILENCE_STEP_H,
    Cycle,
    Job,
    WorkcellLimits,
    WorkcellMemory,
    changes,
    is_fresh,
    miss,
    obstacles,
    take,
)
from bridges.kinds.dispenser.report import WorkcellReport, report
from bridges.kinds.dispenser.signals import Event, ItemRequested, WorkcellOutputs
from bridges.kinds.shared.decision import (
    DecidedByPerson,
    Decision,
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

MOST_LISTED: Final = 100
"""The greatest number of listed requests. It is more than the robots of any site. A further request is
refused."""
MOST_CLOSED: Final = 1000
"""The greatest number of remembered requests that are finished and about which RMF is silent. It is
more than the cycles of a day, so it limits the memory only if requests come without end."""
REMEMBERED_S: Final = 86400.0
STEP_S: Final = SILENCE_STEP_H * 3600.0

Heard = tuple[WorkcellMemory, str]
"""The memory after an event, and the reason for a refusal ("" for an obeyed event)."""


def initial(limits: WorkcellLimits, now: float) -> WorkcellMemory:
    """Return the memory of a workcell that has never had a request."""
    return WorkcellMemory()


def decide(
    memory: WorkcellMemory, event: Event, now: float, limits: WorkcellLimits
) -> Decision[WorkcellMemory, WorkcellOutputs, WorkcellReport]:
    """Apply one event and decide. `now`: monotonic s, never earlier than in the last call. Never
    raises."""
    memory, refused = _hear(memory, event, now, limits)
    memory = _start(
        _end(_watch(_forget(memory, now, limits), now, limits), now, limits), now, limits
    )
    return Decision(
        memory=memory,
        outputs=_outputs(memory, now, limits),
        report=report(memory, now, limits),
        wake_at=min((at for at in changes(memory, limits) if at > now), default=NEVER),
        refused=refused,
    )


def published(memory: WorkcellMemory, shown: WorkcellReport) -> WorkcellMemory:
    """Note that this report and its results were sent to RMF."""
    told = {guid for guid, _ in shown.results}
    jobs = (replace(job, due=False) if job.guid in told else job for job in memory.jobs)
    return replace(memory, jobs=tuple(jobs))


def _hear(memory: WorkcellMemory, event: Event, now: float, limits: WorkcellLimits) -> Heard:
    match event:
        case Sampled(sample):
            senses = take(memory.senses, sample, now, limits)
            return replace(memory, senses=senses, io_failure=""), ""
        case Suspended(reason):
            senses = replace(memory.senses, read_at=None)
            return replace(_cut(memory), senses=senses, io_failure=reason), ""
        case WriteFailed(reason):
            return replace(_cut(memory), io_failure=reason), ""
        case IoFailed(reason):
            return replace(_cut(memory), senses=miss(memory.senses), io_failure=reason), ""
        case RivalSeen():
            return replace(memory, rival_at=now), ""
        case OperatorReset():
            return replace(memory, halted=""), ""
        case MemoryKept():
            return _kept(memory, now, limits), ""
        case MemoryNotKept(reason):
            return replace(memory, not_kept=reason), ""
        case DecidedByPerson():
            return _judge(memory, event, now)
        case ItemRequested():
            return _ask(memory, event, now, limits)


def _cut(memory: WorkcellMemory) -> WorkcellMemory:
    cycle = memory.cycle
    return memory if cycle is None else replace(memory, cycle=replace(cycle, cut=True))


def _kept(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellMemory:
    """Note that the phases of all requests are on disk. A new cycle begins now, because its output
    `start` comes on only now. A failure from before has not cut it.

    The disk may have taken long. If RMF has stopped repeating the request in the meantime, or if
    something forbids the start now, the cycle does not start, and the request is queued again.
    """
    jobs = tuple(replace(job, kept=job.phase) for job in memory.jobs)
    cycle, kept = memory.cycle, replace(memory, jobs=jobs, not_kept="")
    before = memory.job(cycle.guid) if cycle else None
    if cycle is None or before is None or before.kept == "running":
        return kept
    if not (_is_asked(before, now, limits) and _may_start(kept, now, limits)):
        waits = replace(before, phase="queued", kept="running")
        return replace(_put(kept, waits), cycle=None)
    return replace(kept, cycle=Cycle(cycle.guid, now))


def _ask(memory: WorkcellMemory, asked: ItemRequested, now: float, limits: WorkcellLimits) -> Heard:
    job = memory.job(asked.guid)
    if job is None:
        return _new(memory, asked, now)
    if job.item != asked.item and not job.is_over:
        return memory, f"guid of another request: {asked.guid} is for {job.item}"
    heard = replace(job, asked_at=now, heard=True, due=True)
    if job.item != asked.item:
        why = f"asked for {asked.item} under the guid of a request for {job.item} ({job.phase})"
        heard = replace(heard, phase="doubtful", item=asked.item, why=why, closed=False)
    elif job.closed:
        silent_s = limits.t.repeats_within_s
        why = f"{job.phase}, and asked for again after RMF was silent for {silent_s:g} s"
        heard = replace(heard, phase="doubtful", why=why, closed=False)
    return _put(memory, heard), ""


def _new(memory: WorkcellMemory, asked: ItemRequested, now: float) -> Heard:
    if sum(job.phase != "done" for job in memory.jobs) >= MOST_LISTED:
        return memory, f"queue is full: {MOST_LISTED} requests are not done"
    job = Job(asked.guid, asked.item, asked.transporter, asked_at=now, due=True)
    if memory.lost:
        job = replace(job, phase="doubtful", why="asked for before this daemon remembers")
    return replace(memory, jobs=(*memory.jobs, job)), ""


def _put(memory: WorkcellMemory, changed: Job) -> WorkcellMemory:
    jobs = (changed if job.guid == changed.guid else job for job in memory.jobs)
    return replace(memory, jobs=tuple(jobs))


def _judge(memory: WorkcellMemory, said: DecidedByPerson, now: float) -> Heard:
    """Apply a person's decision on the outcome of one request in doubt, or of all requests in doubt."""
    named = [job for job in memory.doubtful() if said.request in ("", job.guid)]
    if not named and (said.request or not memory.lost):
        return memory, f"nothing in doubt: {said.request or 'no request waits for a decision'}"
    for job in named:
        phase = {"done": "done", "failed": "failed", "again": "queued"}[said.verdict]
        why = "a person has decided so" if said.verdict == "failed" else ""
        if job.asked_at is None:
            job = replace(job, asked_at=now, heard=False)
        memory = _put(memory, replace(job, phase=phase, why=why, due=True))
    return (memory if said.request else replace(memory, lost="")), ""


def _forget(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellMemory:
    """Count RMF's silence. Mark a finished request as closed if RMF has not repeated it for
    `repeats_within_s`. Drop a request after a day, and the oldest closed requests above MOST_CLOSED."""
    jobs = []
    for job in memory.jobs:
        silent_s = now - (now if job.asked_at is None else job.asked_at)
        may_go = job.phase not in ("running", "doubtful")
        if silent_s >= REMEMBERED_S and may_go:
            continue
        closes = job.is_over and not job.closed and silent_s >= limits.t.repeats_within_s
        silent_h = int(silent_s // STEP_S) * SILENCE_STEP_H if may_go else 0
        if closes:
            job = replace(job, closed=True, due=False)
        jobs.append(job if job.silent_h == silent_h else replace(job, silent_h=silent_h))
    excess = sum(job.closed for job in jobs) - MOST_CLOSED
    if excess > 0:
        oldest = set(itertools.islice((job.guid for job in jobs if job.closed), excess))
        jobs = [job for job in jobs if job.guid not in oldest]
    return memory if tuple(jobs) == memory.jobs else replace(memory, jobs=tuple(jobs))


def _watch(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellMemory:
    """Note in the running cycle how far it has come, according to the inputs `busy` and the age of the
    reading."""
    cycle, senses = memory.cycle, memory.senses
    if cycle is None:
        return memory
    fresh = is_fresh(senses, now, limits)
    worked = cycle.worked or (fresh and senses.is_on("busy"))
    resting = fresh and worked and senses.is_off("busy")
    rested_at = (now if cycle.rested_at is None else cycle.rested_at) if resting else None
    cut = cycle.cut or resting or not fresh
    return replace(memory, cycle=replace(cycle, worked=worked, rested_at=rested_at, cut=cut))


def _end(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellMemory:
    """End the cycle if the inputs show its end, or if its time is over. A cycle that is not on disk has
    not begun."""
    cycle, job, senses, t = memory.cycle, memory.running(), memory.senses, limits.t
    if cycle is None or job is None or job.kept != "running":
        return memory
    fresh = is_fresh(senses, now, limits)
    why = ""
    if fresh and (senses.is_on("fault") or senses.errors):
        why = f"it reports a fault: {'; '.join(senses.errors) or 'its fault contact is on'}"
    elif fresh and senses.is_on("done"):
        return replace(_put(memory, replace(job, phase="done", due=True)), cycle=None)
    elif cycle.rested_at is not None and now >= cycle.rested_at + t.settle_s:
        why = f"it has stopped, and done did not come within {t.settle_s:g} s"
    elif now >= cycle.started_at + t.cycle_limit_s:
        why = f"done did not come within {t.cycle_limit_s:g} s"
    if not why:
        return memory
    failed = replace(job, phase="failed", why=why, due=True)
    return replace(_put(memory, failed), cycle=None, halted=f"{job.guid} has failed: {why}")


def _start(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellMemory:
    """Start the next request's cycle if nothing forbids it."""
    if memory.cycle is not None or not _may_start(memory, now, limits):
        return memory
    for job in memory.jobs:
        if job.phase == job.kept == "queued" and _is_asked(job, now, limits):
            started = _put(memory, replace(job, phase="running"))
            return replace(started, cycle=Cycle(job.guid, now))
    return memory


def _may_start(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> bool:
    """Return whether the inputs, and all else but the request, permit the start of a cycle."""
    senses = memory.senses
    if any(obstacles(memory, now, limits)) or not senses.seen():
        return False
    return senses.is_off("done") and not (senses.is_off("ready") or senses.is_on("busy"))


def _is_asked(job: Job, now: float, limits: WorkcellLimits) -> bool:
    return job.heard and job.asked_at is not None and now < job.asked_at + limits.t.asked_within_s


def _outputs(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> WorkcellOutputs:
    cycle, job = memory.cycle, memory.running()
    if cycle is None or job is None:
        return WorkcellOutputs()
    on = limits.pulse_s is None or now < cycle.started_at + limits.pulse_s
    return WorkcellOutputs(on and not cycle.cut, job.guid, job.item)
