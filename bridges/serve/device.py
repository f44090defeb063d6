"""One device in service: its core's memory, its driver, and its place on the RMF graph.

A scan is a PLC's: read the inputs, decide, write every output, publish if it is due. The loop that
owns the device's bus calls it; nothing here waits or keeps a thread.
"""

import logging
import math
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from bridges.core.decision import (
    Decision,
    IoFailed,
    OperatorReset,
    RequestRefused,
    RivalSeen,
    Sampled,
    WriteFailed,
)
from bridges.core.kind import Kind
from bridges.log import pairs
from bridges.rmf import stamps
from bridges.rmf.definitions import Message, Time
from bridges.rmf.topics import Topic
from drivers import Driver, DriverError

log = logging.getLogger(__name__)

PUBLISH_EVERY_S = 1.0
PUBLISH_GAP_S = 0.1
"""States go out at 1 Hz, and at once when they change, but never faster than 10 Hz."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Where the time comes from; tests bring their own."""

    monotonic: Callable[[], float]
    wall: Callable[[], float]


def stamp(read_at: float | None, clock: Clock) -> Time:
    """When a reading was taken, on the wall clock as it is now; 0 for never.

    The age is monotonic, so that a step of the wall clock bends neither age nor order.
    """
    if read_at is None:
        return Time()
    return stamps.stamp(clock.wall() - (clock.monotonic() - read_at))


class Node:
    """Serves one device. `publish(topic, message)` sends to RMF and does not raise."""

    def __init__(
        self,
        name: str,
        kind: Kind,
        settings: Any,
        limits: Any,
        driver: Driver[Any, Any],
        publish: Callable[[Topic[Any], Message], None],
        clock: Clock,
    ) -> None:
        self.name = name
        self._kind = kind
        self._settings = settings
        self._limits = limits
        self._driver = driver
        self._publish = publish
        self._clock = clock
        self._memory = kind.initial(limits, clock.monotonic())
        self._decision: Decision[Any, Any, Any] | None = None
        self._open = False
        self._has_read = False
        self._io_fault = ""
        self._failing = False
        self._news: Any = None
        self._told: Any = None
        self._published_at = -math.inf
        self._logged: Mapping[str, str] = {}
        self.refused: Counter[str] = Counter()
        self._counting = threading.Lock()
        self.wake_at = -math.inf

    @property
    def ready(self) -> bool:
        """Each input was read, or timed out, once, and the first state is out."""
        return self._published_at > -math.inf

    def event(self, topic: Topic[Any], message: Any) -> Any:
        """What a message is to the core; None for one that is refused. Any thread may ask."""
        if topic == self._kind.states:
            return RivalSeen()
        try:
            return self._kind.requests[topic](message, self._settings)
        except RequestRefused as refusal:
            self._refuse(refusal.kind, refusal.detail)
            return None

    def scan(self, events: Iterable[Any] = ()) -> None:
        """Read, decide with each event, write, publish."""
        self._failing = False
        self._decide(self._read())
        for event in events:
            if isinstance(event, OperatorReset):  # a device that has failed is claimed anew
                self._open = self._open and not self._io_fault
            self._decide(event)
        self._write()
        if not self._failing:
            self._mended()
        self._tell()

    def make_safe(self) -> bool:
        """Every output off; False, and a log line, when that could not be done or verified."""
        try:
            self._driver.make_safe()
        except DriverError as error:
            log.error(pairs("outputs_not_off", device=self.name, reason=error))
            return False
        return True

    def close(self) -> None:
        """Outputs off, and the points let go."""
        self._driver.close()

    def status(self) -> Mapping[str, Any]:
        """For the status file: what is shown to RMF, what is driven, what is wrong, and its age."""
        decision = self._decision
        if decision is None:
            return {}
        read_at = decision.report.read_at
        age_s = None if read_at is None else round(self._clock.monotonic() - read_at, 3)
        return {
            **self._kind.summary(decision.report),
            "outputs": str(decision.outputs),
            "faults": [{"code": f.code, "detail": f.detail} for f in decision.report.faults],
            "input_age_s": age_s,
            "refused": dict(self.refused),
        }

    def _read(self) -> Sampled[Any] | IoFailed:
        try:
            if not self._open:
                self._driver.open()
                self._open = True
            sample = self._driver.read()
        except DriverError as error:
            return IoFailed(self._failed(error))
        self._has_read = True
        return Sampled(sample)

    def _write(self) -> None:
        """Outputs are levels: the whole set each scan, and nothing before the first reading."""
        if not self._has_read or self._decision is None:
            return
        try:
            self._driver.write(self._decision.outputs)
        except DriverError as error:
            self._decide(WriteFailed(self._failed(error)))

    def _decide(self, event: Any) -> None:
        now = self._clock.monotonic()
        before = self._decision
        self._decision = self._kind.decide(self._memory, event, now, self._limits)
        self._memory = self._decision.memory
        self.wake_at = self._decision.wake_at
        for topic, message in self._decision.publish:
            self._publish(topic, message)
        if self._decision.refused:
            self._refuse(self._decision.refused, event)
        if before is not None and before.outputs != self._decision.outputs:
            log.info(pairs("outputs", device=self.name, outputs=self._decision.outputs))

    def _refuse(self, kind: str, detail: object) -> None:
        """Count it, and log the first of each kind."""
        with self._counting:
            self.refused[kind] += 1
            first = self.refused[kind] == 1
        if first:
            log.warning(pairs("refused", device=self.name, kind=kind, detail=detail))

    def _tell(self) -> None:
        """Publish when it is due; never because a request came."""
        assert self._decision is not None
        report, now = self._decision.report, self._clock.monotonic()
        news = report.news()
        if news != self._news:
            self._log_changes(report)
            self._news = news
        since_s = now - self._published_at
        due_s = PUBLISH_EVERY_S if news == self._told else PUBLISH_GAP_S
        if since_s < due_s:
            self.wake_at = min(self.wake_at, self._published_at + due_s)
            return
        at = stamp(report.read_at, self._clock)
        self._publish(
            self._kind.states, self._kind.state_message(self.name, self._settings, report, at)
        )
        self._told, self._published_at = news, now
        self._memory = self._kind.published(self._memory, report)
        self.wake_at = min(self.wake_at, now + PUBLISH_EVERY_S)

    def _log_changes(self, report: Any) -> None:
        faults = {f"fault:{fault.code}": fault.detail for fault in report.faults}
        summary = dict(self._kind.summary(report))
        before = {key: value for key, value in self._logged.items() if ":" not in key}
        if summary != before:
            log.info(pairs("state", device=self.name, **summary))
        known = {key for key in self._logged if ":" in key}
        for key in faults.keys() - known:
            log.warning(pairs("fault", device=self.name, code=key[6:], detail=faults[key]))
        for key in known - faults.keys():
            log.info(pairs("fault_over", device=self.name, code=key[6:]))
        self._logged = {**summary, **faults}

    def _failed(self, error: DriverError) -> str:
        """Log once when a device goes, not each scan."""
        if not self._io_fault:
            log.error(pairs("device_lost", device=self.name, reason=error))
        self._failing = True
        self._io_fault = str(error) or type(error).__name__
        return self._io_fault

    def _mended(self) -> None:
        """Log once when it is back: reading and writing."""
        if self._io_fault:
            log.info(pairs("device_back", device=self.name))
        self._io_fault = ""
