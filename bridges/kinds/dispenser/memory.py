"""The values that the core of a dispenser or ingestor keeps from one scan to the next, and the settings
that it needs (its limits)."""

from collections.abc import Iterator, Mapping
from typing import Final, Literal

import msgspec

from bridges.kinds.dispenser.settings import WorkcellDurations, WorkcellSettings
from bridges.kinds.dispenser.signals import Item, WorkcellSample
from bridges.kinds.shared.debounce import Settled, forget, settle
from bridges.kinds.shared.decision import NOT_KEPT, Fault
from bridges.kinds.shared.durations import NEVER, RIVAL_QUIET_S

SIGNALS: Final = ("done", "busy", "ready", "fault")
Contact = Settled[bool | None]
"""One debounced input. If an input is not wired, both its settled value and its newest reading
(`candidate`) are None."""
DECIDE: Final = "decide: rmf-bridge workcell done, again or failed"
SHOWN: Final = 3
"""The greatest number of requests in doubt that a fault's text names."""
SILENCE_STEP_H: Final = 3
"""The step (h) in which RMF's silence about a request is saved. A shorter step would write to the disk
more often."""
Phase = Literal["queued", "running", "done", "failed", "doubtful"]
"""The phases of a request. `doubtful`: only a person can find out the outcome."""


class WorkcellLimits(msgspec.Struct, frozen=True):
    """The settings that the core needs. `debounce` maps a signal to its debounce (s). `pulse_s`: the
    length of the pulse on the output `start`; None for an output that stays on."""

    t: WorkcellDurations = WorkcellDurations()
    debounce: Mapping[str, float] = {}
    pulse_s: float | None = None

    @classmethod
    def of(cls, settings: WorkcellSettings, debounce: Mapping[str, float]) -> "WorkcellLimits":
        """Make the limits from the YAML and from `debounce`, which maps each wired signal to its
        debounce (s)."""
        return cls(settings.limits, debounce, settings.pulse_s)


class WorkcellSenses(msgspec.Struct, frozen=True):
    """The inputs. Each is None before its first reading. `read_at`: the time of the last reading."""

    done: Contact | None = None
    busy: Contact | None = None
    ready: Contact | None = None
    fault: Contact | None = None
    errors: tuple[str, ...] = ()
    read_at: float | None = None

    def is_on(self, signal: str) -> bool:
        """Return whether this input has settled as asserted."""
        contact: Contact | None = getattr(self, signal)
        return contact is not None and contact.value is True

    def is_off(self, signal: str) -> bool:
        """Return whether this input has settled as not asserted. For an input that is not wired the
        answer is False."""
        contact: Contact | None = getattr(self, signal)
        return contact is not None and contact.value is False

    def seen(self) -> bool:
        """Return whether each input has settled."""
        contacts: list[Contact | None] = [getattr(self, signal) for signal in SIGNALS]
        return all(one is not None and one.steady_at is not None for one in contacts)


class Job(msgspec.Struct, frozen=True):
    """One request. `kept`: its phase as the disk has it, None if it is not on disk yet. Messages and
    outputs follow `kept`. So after a restart the daemon never contradicts what it has already
    published or switched.

    `transporter`: the fleet that asks. `why`: the reason for a failure or a doubt. `asked_at`: the time
    since which RMF has been silent about the request. This is the time of RMF's last request, or, if
    `heard` is False, a time from before this daemon has heard the request. `silent_h`: the hours of
    this silence, in steps of SILENCE_STEP_H, which count on after a restart. `due`: RMF waits for a
    result. `closed`: RMF has been silent about a finished request for a long time, so a repeat would be
    in doubt.
    """

    guid: str
    item: Item = Item()
    transporter: str = ""
    phase: Phase = "queued"
    why: str = ""
    kept: Phase | None = None
    asked_at: float | None = None
    due: bool = False
    closed: bool = False
    heard: bool = True
    silent_h: int = 0

    @property
    def named(self) -> str:
        """Describe the request for people: its guid, its content, and the fleet that asks."""
        whose = f" for {self.transporter}" if self.transporter else ""
        return f"{self.guid} ({self.item}{whose})"

    @property
    def is_over(self) -> bool:
        """Return whether the request is done or has failed."""
        return self.phase in ("done", "failed")

    @property
    def is_listed(self) -> bool:
        """Return whether the request is in the published queue.

        If a request is no longer in the queue, RMF assumes that it is done. So a request leaves the
        queue only when its phase on disk is `done`. A failed request stays in the queue.
        """
        return self.kept is not None and (self.phase, self.kept) != ("done", "done")


class Cycle(msgspec.Struct, frozen=True):
    """The cycle that runs. `started_at`: the output `start` may be on since this time. `worked`: `busy`
    was seen on. `rested_at`: `busy` has been off again since this time. `cut`: something has failed
    in this cycle, so `start` stays off until the cycle's end."""

    guid: str
    started_at: float
    worked: bool = False
    rested_at: float | None = None
    cut: bool = False


class WorkcellMemory(msgspec.Struct, frozen=True):
    """The facts of the past that the next decision needs. Times are monotonic seconds.

    `lost`: the reason why the memory of earlier requests is missing. `halted`: the reason why no cycle
    starts before an operator's reset. `not_kept`: the reason why the memory is not on disk.
    """

    jobs: tuple[Job, ...] = ()
    cycle: Cycle | None = None
    senses: WorkcellSenses = WorkcellSenses()
    lost: str = ""
    halted: str = ""
    rival_at: float | None = None
    io_failure: str = ""
    not_kept: str = ""

    def job(self, guid: str) -> Job | None:
        """Return the request with this guid."""
        return next((job for job in self.jobs if job.guid == guid), None)

    def running(self) -> Job | None:
        """Return the request whose cycle runs. A cycle that is not on disk yet does not count."""
        job = self.job(self.cycle.guid) if self.cycle else None
        return job if job is not None and job.kept == "running" else None

    def doubtful(self) -> tuple[Job, ...]:
        """Return the requests whose outcome is unknown."""
        return tuple(job for job in self.jobs if job.phase == "doubtful")


def take(
    senses: WorkcellSenses, sample: WorkcellSample, now: float, limits: WorkcellLimits
) -> WorkcellSenses:
    """Add one reading. After a long time without readings every input is unknown again."""
    if not is_fresh(senses, now, limits):
        senses = WorkcellSenses()
    contacts: dict[str, Contact] = {
        signal: settle(
            getattr(senses, signal), getattr(sample, signal), now, limits.debounce.get(signal, 0.0)
        )
        for signal in SIGNALS
    }
    return WorkcellSenses(**contacts, errors=sample.errors, read_at=now)


def miss(senses: WorkcellSenses) -> WorkcellSenses:
    """Restart the debounce after a failed read."""
    contacts = {signal: forget(getattr(senses, signal)) for signal in SIGNALS}
    return msgspec.structs.replace(senses, **contacts)


def is_fresh(senses: WorkcellSenses, now: float, limits: WorkcellLimits) -> bool:
    """Return whether the last reading is younger than `stale_after_s`."""
    return senses.read_at is not None and now < senses.read_at + limits.t.stale_after_s


def rivalled(memory: WorkcellMemory, now: float) -> bool:
    """Return whether another node publishes states under this name."""
    return memory.rival_at is not None and now < memory.rival_at + RIVAL_QUIET_S


def obstacles(memory: WorkcellMemory, now: float, limits: WorkcellLimits) -> Iterator[Fault]:
    """Yield every fault that keeps a cycle from starting, most serious first. No text contains a number
    that changes all the time, because every change of a text is published."""
    if memory.lost:
        yield Fault("MEMORY_LOST", f"{memory.lost}; {DECIDE}")
    if doubtful := memory.doubtful():
        yield Fault("OUTCOME_UNKNOWN", _doubts(doubtful))
    if memory.not_kept:
        yield Fault(NOT_KEPT, f"nothing is accepted or started: {memory.not_kept}")
    if rivalled(memory, now):
        yield Fault("TWO_NODES_FOR_ONE_DEVICE", "another node publishes states of this workcell")
    if not is_fresh(memory.senses, now, limits):
        silent = f"no reading for {limits.t.stale_after_s} s"
        yield Fault("COMMUNICATION_LOST", memory.io_failure or silent)
    if memory.halted:
        yield Fault(
            "WORKCELL_HALTED", f"{memory.halted}; rmf-bridge reset when the workcell is clear"
        )
    if memory.senses.is_on("fault") or memory.senses.errors:
        errors = "; ".join(memory.senses.errors)
        yield Fault("WORKCELL_FAULT", errors or "its fault contact is on")


def _doubts(jobs: tuple[Job, ...]) -> str:
    named = "; ".join(f"{job.named}: {job.why}" for job in jobs[:SHOWN])
    more = f"; and {len(jobs) - SHOWN} more" if len(jobs) > SHOWN else ""
    return f"{named}{more}; look, then {DECIDE}"


def changes(memory: WorkcellMemory, limits: WorkcellLimits) -> Iterator[float]:
    """Yield each time at which the decision may change without an event (s)."""
    senses, t, cycle = memory.senses, limits.t, memory.cycle
    if senses.read_at is not None:
        yield senses.read_at + t.stale_after_s
    for signal in SIGNALS:
        contact: Contact | None = getattr(senses, signal)
        if contact is not None:
            yield contact.due_at(limits.debounce.get(signal, 0.0))
    if memory.rival_at is not None:
        yield memory.rival_at + RIVAL_QUIET_S
    for job in memory.jobs:
        if job.is_over and not job.closed and job.asked_at is not None:
            yield job.asked_at + t.repeats_within_s
    if cycle is not None:
        yield cycle.started_at + t.cycle_limit_s
        yield cycle.started_at + (limits.pulse_s or NEVER)
        yield NEVER if cycle.rested_at is None else cycle.rested_at + t.settle_s
