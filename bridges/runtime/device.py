"""The node that serves one device. It scans the device's driver, and calls the device's core, which
decides about the outputs and the state.

A scan works as in a PLC: read the inputs, decide, write every output, and publish if a state is due.
The loop of the device's bus calls `scan`. No function in this file blocks or has its own thread.
"""

import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Generic

from bridges.kinds.shared.decision import (
    AlarmInputs,
    Fault,
    IoFailed,
    M,
    O,
    OperatorReset,
    R,
    RequestRefused,
    Said,
    Sampled,
    Suspended,
    WriteFailed,
    X,
)
from bridges.kinds.shared.durations import AGES_AGO
from bridges.kinds.shared.kind import DeviceEvent, E, Kind, L, RefusalAnswer, S
from bridges.messages.definitions import Message
from bridges.messages.stamps import ClockError
from bridges.messages.topics import Topic
from bridges.runtime import diagnostics
from bridges.runtime.answers import RefusalAnswers
from bridges.runtime.clock import TELL_EVERY_S, Clock, PublishPace
from bridges.runtime.contained import Contained
from bridges.runtime.device_memory import DeviceKeeper, DeviceMemories, Unkept
from bridges.runtime.refusals import Refusals
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.scan_counts import COUNTS, ScanCounts
from bridges.runtime.subject import Publish, Status, Subject, SubjectCore
from bridges.system.log import pairs, plain
from drivers import Driver, DriverError

NotSent = Callable[[Topic[Message], Exception], None]
TellAlarm = Callable[[str, AlarmInputs], None]

log = logging.getLogger(__name__)


class Node(Generic[S, L, M, X, E, O, R]):
    """The node that serves one device.

    - `publish(topic, message)` sends a message to RMF and raises nothing.
    - `not_sent(topic, error)` notes a state that cannot be sent.
    - `tell_alarm(name, inputs)` passes the device's causes for an alarm to the daemon's alarm. It is
      None if the device raises no alarm.
    """

    def __init__(
        self,
        name: str,
        kind: Kind[S, L, M, X, E, O, R],
        settings: S,
        limits: L,
        driver: Driver[X, O],
        publish: Publish,
        clock: Clock,
        writer: NoWriter = NOBODY,
        not_sent: NotSent = lambda topic, error: None,
        tell_alarm: TellAlarm | None = None,
        memories: DeviceMemories | None = None,
    ) -> None:
        self.name = name
        self.wake_at = AGES_AGO
        self._kind = kind
        self._settings = settings
        self._driver = Contained(name, driver, clock)
        self._publish = publish
        self._not_sent = not_sent
        self._tell_alarm = tell_alarm
        self._alarm_told: AlarmInputs | None = None
        self._alarm_at = AGES_AGO
        self._clock = clock
        self._refusals = Refusals()
        memory = kind.initial(limits, clock.monotonic())
        self._keeper: DeviceKeeper[M] | None = None
        if kind.keeping is not None:
            memories = memories or DeviceMemories(Unkept(), new=True)
            self._keeper = DeviceKeeper(name, kind.keeping, memories)
            memory = self._keeper.restore(memory, clock.monotonic())
        self._outputs_first = kind.keeping is not None and kind.keeping.outputs_first
        core: SubjectCore[M, DeviceEvent[X, E], O, R] = SubjectCore(
            "device",
            lambda memory, event, now: kind.decide(memory, event, now, limits),
            lambda report, now: kind.summary(report),
            self._identity,
            kind.repeated,
        )
        self.subject = Subject(name, memory, core, publish, self._refusals, clock, writer)
        self._pace = PublishPace()
        self._answers = RefusalAnswers()
        self._open = False
        self._has_read = False
        self._contacts: Mapping[str, bool] = {}
        self._io_fault = ""
        self._bus_words: set[str] = set()
        self._failing = False
        self._logged_outputs: O | None = None
        self._counts = ScanCounts()

    @property
    def ready(self) -> bool:
        """Return whether the first state is published. Before the first state, each input is read or
        times out once."""
        return self._pace.told_at > AGES_AGO

    @property
    def answers(self) -> bool:
        """Return whether the last scan read every input and wrote every output."""
        return self._has_read and not self._io_fault

    def refuse(self, message: Message, refusal: RequestRefused) -> None:
        """Count a refused message, and answer it. Any thread may call this method."""
        self._refusals.add(refusal.kind, refusal.detail, device=self.name)
        self._answers.add(message, str(refusal))

    def was_suspended(self, for_s: float) -> None:
        """Tell the core that no input was read for `for_s` (s). Then the core no longer trusts older
        readings."""
        self._decide(Suspended(f"nothing was read for {for_s:.1f} s"))

    def scan(self, events: Iterable[DeviceEvent[X, E]] = ()) -> None:
        """Read the inputs, decide on each event, write the outputs, and publish."""
        started = self._clock.monotonic()
        self._failing = False
        self._bus_words.clear()
        reading, events = self._read(), tuple(events)
        if not events and self._is_nothing_new(reading, started):
            self._write()
            if not self._failing:
                self._count(self._clock.monotonic() - started)
                return
        else:
            self._decide_all(reading, events)
        took_s = self._clock.monotonic() - started
        self._alarm()
        if self._outputs_first and self._keep():
            self._write()
        self._tell()
        self._answer()
        self._count(took_s)
        self._contacts = {} if self._failing else self._driver.contacts()
        self._log()

    def _is_nothing_new(self, reading: Sampled[X] | IoFailed, now: float) -> bool:
        """Return whether this reading only repeats the last reading, while no state or timer is due."""
        due = now >= self.wake_at or (self._tell_alarm is not None and now >= self._alarm_at)
        return not due and self.subject.read_again(reading)

    def _decide_all(
        self, reading: Sampled[X] | IoFailed, events: Iterable[DeviceEvent[X, E]]
    ) -> None:
        self._decide(reading)
        for event in events:
            if isinstance(event, OperatorReset):  # claim a failed device again at the next scan
                self._open = self._open and not self._io_fault
            self._decide(event)
        if not self._outputs_first:
            self._keep()
        self._write()

    def make_safe(self) -> bool:
        """Switch every output off. If an output is not verified off, log this and return False."""
        try:
            self._driver.make_safe()
        except DriverError as error:
            log.error(pairs("outputs_not_off", device=self.name, reason=error))
            return False
        return True

    def close(self) -> None:
        """Switch the outputs off and release the points."""
        self._driver.close()

    @property
    def refused(self) -> dict[str, int]:
        """The number of refused requests, by reason."""
        return self._refusals.counts()

    def status(self) -> Status:
        """Return the device's part of the status file: state, outputs, faults, age of the inputs,
        contacts."""
        decision = self.subject.decision
        if decision is None:
            return {}
        outputs = plain(decision.outputs)
        shown = {**self.subject.status(), "outputs": outputs, "refused": self.refused}
        shown[COUNTS] = self._counts.status()
        contacts = {diagnostics.CONTACTS: self._contacts} if self._contacts else {}
        return {**shown, **contacts, **self._answers.status()}

    def _read(self) -> Sampled[X] | IoFailed:
        try:
            if not self._open:
                self._driver.open()
                self._open = True
            sample = self._driver.read()
        except DriverError as error:
            return IoFailed(self._failed(error))
        self._has_read = True
        return Sampled(sample)

    def _keep(self) -> bool:
        """Write the core's memory to disk, before its decision takes effect. States are published only
        afterwards. Return whether the core has decided again."""
        if self._keeper is None:
            return False
        kept: Any = self._keeper.keep(self.subject.memory, self._clock.monotonic())
        if kept is not None:  # every kind with `keeping` has such an event
            self._decide(kept)
        return kept is not None

    def _write(self) -> None:
        """Write the levels of all outputs. Write nothing before the first reading."""
        if not self._has_read or self.subject.decision is None:
            return
        try:
            self._driver.write(self.subject.decision.outputs)
        except DriverError as error:
            self._decide(WriteFailed(self._failed(error)))

    def _decide(self, event: DeviceEvent[X, E]) -> None:
        decision = self.subject.decide(event)
        if decision.refused:
            self._answers.add(event, decision.refused)
        outputs = decision.outputs
        self._logged_outputs = outputs if self._logged_outputs is None else self._logged_outputs

    def _alarm(self) -> None:
        """Pass the device's causes for an alarm to the daemon's alarm, each second and at once after a
        change."""
        if self._tell_alarm is None or self._kind.alarm_inputs is None:
            return
        assert self.subject.decision is not None
        now, inputs = self._clock.monotonic(), self._kind.alarm_inputs(self.subject.decision.report)
        if inputs != self._alarm_told or now >= self._alarm_at:
            self._alarm_told, self._alarm_at = inputs, now + TELL_EVERY_S
            self._tell_alarm(self.name, inputs)

    def _count(self, took_s: float) -> None:
        decision = self.subject.decision
        assert decision is not None
        self._counts.scanned(took_s, decision.outputs, failed=self._failing)

    def _tell(self) -> None:
        """Publish the state and then the results, if the state is due. A request does not make the
        state due, unless the state changes."""
        subject, now = self.subject, self._clock.monotonic()
        assert subject.decision is not None
        report = subject.decision.report
        news, results = report.news(), self._kind.results(self.name, report)
        if now >= self._pace.due_at(news, at_once=bool(results)):
            if self._send(report):  # tell the core, because a robot may enter a lift after OPEN
                self._send_results(results)
                subject.published(self._kind.published(subject.memory, report))
                results = ()
            self._pace.published(news, now)
        self.wake_at = min(subject.wake_at, self._pace.due_at(news, at_once=bool(results)))

    def _answer(self) -> None:
        """Publish the answers to refused requests. An answer names the reason and the device's
        holder."""
        self._answers.say(self._clock.monotonic(), self._answered, self._publish)
        self.wake_at = min(self.wake_at, self._answers.due_at)

    def _answered(self, request: object, reason: str) -> RefusalAnswer | None:
        decision = self.subject.decision
        assert decision is not None
        found = self._kind.answer(self.name, request, reason, decision.report)
        if found is None:
            return None
        try:
            stamp = self._clock.stamp(self._clock.monotonic())
        except ClockError:
            return None  # _send notes this error
        return found._replace(message=self._kind.stamped(found.message, stamp))

    def _send_results(self, results: Iterable[Said]) -> None:
        for topic, message in results:
            stamp = self._clock.stamp(self._clock.monotonic())
            self._publish(topic, self._kind.stamped(message, stamp))

    def _send(self, report: R) -> bool:
        """Publish the state. Return False if the state was not sent, or if RMF has no message for this
        kind of device."""
        topic, state_of = self._kind.states, self._kind.state_message
        if topic is None or state_of is None:
            return False
        try:
            at = self._clock.stamp(report.read_at)
        except ClockError as error:
            self._not_sent(topic, error)
            return False
        return self._publish(topic, state_of(self.name, self._settings, report, at)) is not False

    def _log(self) -> None:
        """Log the changes. Logging is the last step of a scan, because writing a log line takes as long
        as the rest of the scan."""
        decision = self.subject.decision
        assert decision is not None
        if decision.outputs != self._logged_outputs:
            log.info(pairs("outputs", device=self.name, outputs=decision.outputs))
        self._logged_outputs = decision.outputs
        self.subject.log(decision.report)
        if self._io_fault and not self._failing:  # reading and writing succeed again
            log.info(pairs("device_back", device=self.name))
            self._io_fault = ""

    def _failed(self, error: DriverError) -> str:
        """Note a failed scan, and return the error's text. Log the loss of the device once."""
        if not self._io_fault:
            log.error(pairs("device_lost", device=self.name, reason=error))
        self._failing = True
        self._io_fault = str(error) or type(error).__name__
        self._bus_words.add(self._io_fault)
        return self._io_fault

    def _identity(self, fault: Fault) -> object:
        """Return a value by which reports of one fault are recognised as equal.

        The value is the fault's code alone if the fault's detail is an error text of a bus, because
        such texts vary. Texts of the previous scan count too, because the core repeats the last text
        for one more scan.
        """
        bus_words = ("", self._io_fault, *self._bus_words)
        return fault.code if fault.detail in bus_words else fault


AnyNode = Node[Any, Any, Any, Any, Any, Any, Any]
"""A node of a kind that was found by name. Therefore the type checker does not know its types."""
