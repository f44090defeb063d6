"""One subject of a kind without hardware: its core's memory, and what the log and status say of it."""

import logging
import math
from collections.abc import Mapping, Sequence
from typing import Any

from bridges.core.decision import Fault
from bridges.core.graph_kind import GraphKind
from bridges.log import pairs
from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic
from bridges.serve.device import Clock

log = logging.getLogger(__name__)


class Subject:
    """One lift or door that the kind's core looks after."""

    def __init__(
        self, name: str, kind: GraphKind, limits: Any, started_at: float, clock: Clock
    ) -> None:
        self.name = name
        self._kind = kind
        self._limits = limits
        self._clock = clock
        self.memory = kind.initial(name, started_at)
        self.wake_at = math.inf
        self._report: Any = None
        self._news: Any = None
        self._faults: tuple[Fault, ...] = ()

    def decide(self, event: Any) -> tuple[Sequence[tuple[Topic[Any], Message]], str]:
        """One step of the core: what to publish, and why the event was refused."""
        now = self._clock.monotonic()
        decision = self._kind.decide(self.memory, event, now, self._limits)
        self.memory, self.wake_at = decision.memory, decision.wake_at
        self._report = decision.report
        self._log_changes(now)
        return decision.publish, decision.refused

    def idle(self, now: float) -> bool:
        """It need not be remembered."""
        return self._kind.idle(self.memory, now)

    def status(self) -> Mapping[str, Any]:
        """For the status file; from any thread."""
        if self._report is None:
            return {}
        now, read_at = self._clock.monotonic(), self._report.read_at
        return {
            **self._kind.summary(self._report, now),
            "faults": [{"code": f.code, "detail": f.detail} for f in self._report.faults],
            "input_age_s": None if read_at is None else round(now - read_at, 3),
        }

    def _log_changes(self, now: float) -> None:
        faults, before = self._report.faults, self._faults
        if self._report.news() != self._news:
            log.info(pairs("state", subject=self.name, **self._kind.summary(self._report, now)))
        for fault in faults:
            if fault not in before:
                log.warning(pairs("fault", subject=self.name, code=fault.code, detail=fault.detail))
        for fault in before:
            if fault not in faults:
                log.info(
                    pairs("fault_over", subject=self.name, code=fault.code, detail=fault.detail)
                )
        self._news, self._faults = self._report.news(), faults
