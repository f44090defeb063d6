"""One subject, about which a core decides: a lift, a door, a charger, or a coordinator's site.

A `Subject` keeps the core's memory, carries out each decision, counts refusals and logs changes.
"""

import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from bridges.kinds.shared.decision import Decision, Fault, M, O, OrderedByPerson, R, Sampled
from bridges.kinds.shared.durations import NEVER
from bridges.messages.definitions import Message
from bridges.messages.topics import Topic
from bridges.runtime.clock import Clock
from bridges.runtime.refusals import Refusals
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.system.log import pairs, plain

log = logging.getLogger(__name__)

Status = Mapping[str, Any]
"""A part of the status file, as JSON values."""

Publish = Callable[[Topic[Message], Message], bool | None]
"""A function that sends a message to RMF. It returns False on failure, and raises nothing."""

V = TypeVar("V")
"""The type of a core's events."""


class SubjectCore(Struct, Generic[M, V, O, R], frozen=True):
    """The core of a kind, with its limits, as the daemon calls it.

    - `word`: the key under which the log shows a subject's name
    - `decide(memory, event, now)`: one step of the core
    - `summary(report, now)`: keys and values for the log and the status file
    - `identity(fault)`: a value that is equal in all reports of one fault, so that the fault is logged
      once
    - `repeated(memory, now)`: the memory after a repeated reading (see `Kind`), or None if the core
      must decide on every event
    """

    word: str
    decide: Callable[[M, V, float], Decision[M, O, R]]
    summary: Callable[[R, float], Mapping[str, str]]
    identity: Callable[[Fault], object]
    repeated: Callable[[M, float], M] | None = None


class Subject(Generic[M, V, O, R]):
    """One subject of a core, with its memory.

    `ordered`: a person's last order, and the core's reason if it refused this order, otherwise "". Any
    thread may read `ordered`.
    """

    def __init__(
        self,
        name: str,
        memory: M,
        core: SubjectCore[M, V, O, R],
        publish: Publish,
        refusals: Refusals,
        clock: Clock,
        writer: NoWriter = NOBODY,
    ) -> None:
        self.name = name
        self.memory = memory
        self.wake_at = NEVER
        self.decision: Decision[M, O, R] | None = None
        self.ordered: tuple[object, str] = (None, "")
        self._core = core
        self._whose = {core.word: name}
        self._event: object = None
        self._is_steady = False
        self._publish = publish
        self._refusals = refusals
        self._clock = clock
        self._writer = writer
        self._logged_news: object = None
        self._logged: Mapping[str, str] = {}
        self._faults: Mapping[object, Fault] = {}

    def decide(self, event: V) -> Decision[M, O, R]:
        """Let the core decide on an event, and carry out the decision."""
        before, now = self.memory, self._clock.monotonic()
        decision = self._core.decide(before, event, now)
        self._writer.decided(self.name, before, event, now, decision)
        self._is_steady = self._is_as_before(event, decision, now)
        self._event = event
        self.memory, self.wake_at, self.decision = decision.memory, decision.wake_at, decision
        if isinstance(event, OrderedByPerson):
            self.ordered = event, decision.refused
        for topic, message in decision.publish:
            self._publish(topic, message)
        if decision.refused:
            kind, _, detail = decision.refused.partition(": ")
            asked = plain(event)
            self._refusals.add(kind, f"{detail}; {asked}" if detail else asked, **self._whose)
        return decision

    def read_again(self, event: V) -> bool:
        """Note a reading that came before `wake_at`. Return False if the core must decide on it.

        The core need not decide on a repeated reading. The previous event must be an equal reading, and
        the decision on it must have changed only the reading's times. Until `wake_at` the core would
        decide the same again.
        """
        now, decision, repeated = self._clock.monotonic(), self.decision, self._core.repeated
        if not self._is_steady or event != self._event or decision is None or repeated is None:
            return False
        before, self.memory = self.memory, repeated(self.memory, now)
        report: Any = decision.report
        report = replace(report, read_at=now)
        self.decision = replace(decision, memory=self.memory, report=report)
        self._writer.decided(self.name, before, self._event, now, self.decision)
        return True

    def _is_as_before(self, event: V, decision: Decision[M, O, R], now: float) -> bool:
        """Return whether this reading equals the previous event, and the decision on it changes only
        the reading's times."""
        last, repeated = self.decision, self._core.repeated
        if repeated is None or last is None or not isinstance(event, Sampled):
            return False
        if event != self._event or decision.refused or decision.publish:
            return False
        report: Any = last.report
        return (
            decision.outputs == last.outputs
            and decision.report == replace(report, read_at=now)
            and decision.memory == repeated(self.memory, now)
        )

    def published(self, memory: M) -> None:
        """Note that the subject's report was published. `memory`: the core's memory after the
        publication."""
        if memory is not self.memory:
            self.memory = memory
            self._is_steady = False
            self._writer.published(self.name, memory, self._clock.monotonic())

    def log(self, report: R) -> None:
        """Log the changes since the last report."""
        news = report.news()
        if news != self._logged_news:
            self._logged_news = news
            self._log_state(self._core.summary(report, self._clock.monotonic()))
        if report.faults or self._faults:
            self._log_faults({self._core.identity(fault): fault for fault in report.faults})

    def status(self) -> Status:
        """Return the subject's status for the status file. Any thread may call this method."""
        decision = self.decision
        if decision is None:
            return {}
        report, now = decision.report, self._clock.monotonic()
        read_at = report.read_at
        return {
            **self._core.summary(report, now),
            "faults": [{"code": f.code, "detail": f.detail} for f in report.faults],
            "input_age_s": None if read_at is None else round(now - read_at, 3),
        }

    def _log_state(self, summary: Mapping[str, str]) -> None:
        if summary != self._logged:
            log.info(pairs("state", **self._whose, **summary))
        self._logged = summary

    def _log_faults(self, faults: Mapping[object, Fault]) -> None:
        before, self._faults = self._faults, faults
        for fault in (faults[key] for key in faults if key not in before):
            log.warning(pairs("fault", **self._whose, code=fault.code, detail=fault.detail))
        for fault in (before[key] for key in before if key not in faults):
            log.info(pairs("fault_over", **self._whose, code=fault.code, detail=fault.detail))


AnySubject = Subject[Any, Any, Any, Any]
"""A subject whose core's types are unknown."""


def refusals_of(order: OrderedByPerson, subjects: Sequence[AnySubject]) -> dict[str, str] | None:
    """Return the subjects that have refused this order, with their reasons. Return None until every
    subject has decided about the order."""
    taken = {one.name: one.ordered for one in subjects}
    if any(given is not order for given, _ in taken.values()):
        return None
    return {name: why for name, (_, why) in taken.items() if why}
