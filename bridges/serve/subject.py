"""One lift, door or charger (or a coordinator's site): its core's memory, and what becomes of a
decision: messages go out, refusals are counted, states and faults are logged when they change."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from bridges.core.decision import Decision, Fault, M, O, R
from bridges.core.durations import NEVER
from bridges.log import pairs, plain
from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic
from bridges.serve.clock import Clock
from bridges.serve.refusals import Refusals

log = logging.getLogger(__name__)

Status = Mapping[str, Any]
"""What the status file says of something, as JSON has it."""

Publish = Callable[[Topic[Message], Message], None]
"""Sends to RMF, and does not raise."""

V = TypeVar("V")
"""Everything that a core may be told."""


@dataclass(frozen=True, slots=True)
class Core(Generic[M, V, O, R]):
    """A kind's core with its limits, as subjects need it.

    `word`: what a subject is called in the log. `decide(memory, event, now)`. `summary(report, now)`:
    key -> value for the log and the status file. `identity(fault)`: by what a fault is the one that
    was logged before.
    """

    word: str
    decide: Callable[[M, V, float], Decision[M, O, R]]
    summary: Callable[[R, float], Mapping[str, str]]
    identity: Callable[[Fault], object]


class Subject(Generic[M, V, O, R]):
    """What one core looks after."""

    def __init__(
        self,
        name: str,
        memory: M,
        core: Core[M, V, O, R],
        publish: Publish,
        refusals: Refusals,
        clock: Clock,
    ) -> None:
        self.name = name
        self.memory = memory
        self.wake_at = NEVER
        self.decision: Decision[M, O, R] | None = None
        self._core = core
        self._whose = {core.word: name}
        self._publish = publish
        self._refusals = refusals
        self._clock = clock
        self._logged_news: object = None
        self._logged: Mapping[str, str] = {}
        self._faults: Mapping[object, Fault] = {}

    def decide(self, event: V) -> Decision[M, O, R]:
        """One step of the core."""
        decision = self._core.decide(self.memory, event, self._clock.monotonic())
        self.memory, self.wake_at, self.decision = decision.memory, decision.wake_at, decision
        for topic, message in decision.publish:
            self._publish(topic, message)
        if decision.refused:
            kind, _, detail = decision.refused.partition(": ")
            asked = plain(event)
            self._refusals.add(kind, f"{detail}; {asked}" if detail else asked, **self._whose)
        return decision

    def log(self, report: R) -> None:
        """Say once what is new in a report."""
        news = report.news()
        if news != self._logged_news:
            self._logged_news = news
            self._log_state(self._core.summary(report, self._clock.monotonic()))
        if report.faults or self._faults:
            self._log_faults({self._core.identity(fault): fault for fault in report.faults})

    def status(self) -> Status:
        """For the status file; from any thread."""
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
