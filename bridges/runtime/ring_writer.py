"""Records a daemon's readings, decisions and messages in its ring, which is a file of limited size.

A scan only puts events into a queue, which takes less than a microsecond. After the outputs are written
and the states are published, `flush` encodes the events and appends them to the ring. If writing fails,
entries are lost, but nothing is raised and no scan is delayed.
"""

import struct
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from bridges.blackbox import entries
from bridges.blackbox.entries import AnyEntry, Clocks, Published, Same, Spoken, SubjectForgotten
from bridges.blackbox.known import AnyDecision, KnownSubject, known, step
from bridges.blackbox.ring import FRAME, Ring
from bridges.kinds.shared.decision import IoFailed, Sampled
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.messages import cdr
from bridges.messages.definitions import Message
from bridges.messages.heard import Sender
from bridges.messages.releases import Release
from bridges.messages.rihs01 import type_name
from bridges.messages.words import LONGEST_NAME
from bridges.runtime.clock import Clock
from bridges.runtime.runtime_directory import Once

KNOWN_EVERY_S: Final = 60.0
"""The interval (s) at which all known state is written again. A reader can begin to replay at each of
these places."""
MOST_WAITING: Final = 20_000
SAME_AT_ONCE: Final = 20
"""The number of unchanged readings that are written as one entry. If the daemon is killed, at most
twice this number of readings of each device are lost."""
LONGEST_SAME: Final = 400
"""The maximum size (bytes) of an entry with unchanged readings."""
MOST_SPOKEN_PER_S: Final = 200.0
"""The maximum rate (messages per second) at which messages are recorded. Above this rate messages are
only counted, because a flood must not delay a scan."""
STEP_S: Final = 0.05
AGAIN_S: Final = 10.0
"""The pause (s) between the failure of a ring and the next attempt to make a ring."""


class NoWriter:
    """The writer of a daemon that does not record. It has the interface of `RingWriter`."""

    def decided(
        self, subject: str, before: object, event: object, now: float, decision: AnyDecision
    ) -> None:
        """Note a core's decision. `before`: the subject's memory before the decision. If a reading
        repeats the last reading, `event` must be the same object as the last time."""

    def published(self, subject: str, memory: object, now: float) -> None:
        """Note that a report was published. `memory`: the core's memory after the publication."""

    def forgotten(self, subject: str, now: float) -> None:
        """Note that the daemon has forgotten a subject."""

    def spoken(
        self, topic: str, message: Message, *, sent: bool, sender: Sender | None = None
    ) -> None:
        """Note a message that was heard or sent on this topic. `sender`: the message's publisher, if
        known."""

    def flush(self) -> None:
        """Write the noted events. The daemon calls this method when it has no urgent work. A few
        repeated readings may stay in the queue until a later call."""

    def look(self) -> None:
        """Make a new ring if needed. The daemon's main thread calls this method each second."""

    def died(self, reason: str) -> None:
        """Note that the daemon ends because of a defect."""

    def ended(self, *, safe: bool) -> None:
        """Note that the daemon shuts down cleanly."""


NOBODY: Final = NoWriter()


class RingWriter(NoWriter):
    """The writer of one daemon's ring. Any thread may call any method."""

    def __init__(
        self, make: Callable[[], Ring], clock: Clock, release: Callable[[], Release]
    ) -> None:
        """Make the writer and the first ring. `make()` returns a new ring, or raises OSError."""
        self._make = make
        self._clock = clock
        self._release = release
        self._ring: Ring | None = None
        self._lock = threading.Lock()
        self._waiting: deque[tuple[Any, ...]] = deque(maxlen=MOST_WAITING)
        self._once = Once()
        self._again_at = AGES_AGO
        self._news = True
        self._events: dict[str, object] = {}
        self._dead = False
        self._fresh()
        self.look()

    def decided(
        self, subject: str, before: object, event: object, now: float, decision: AnyDecision
    ) -> None:
        self._waiting.append((self._step, subject, before, event, now, decision))
        self._news |= self._events.get(subject) is not event
        self._events[subject] = event

    def published(self, subject: str, memory: object, now: float) -> None:
        self._note(self._published, subject, memory, now)

    def forgotten(self, subject: str, now: float) -> None:
        self._events.pop(subject, None)
        self._note(self._forgotten, subject, now)

    def spoken(
        self, topic: str, message: Message, *, sent: bool, sender: Sender | None = None
    ) -> None:
        self._note(self._spoken, self._clock.monotonic(), topic, message, sent, sender)

    def died(self, reason: str) -> None:
        self._dead = True
        self._note(self._last, entries.DaemonDied(self._clock.monotonic(), reason))
        self.flush()

    def ended(self, *, safe: bool) -> None:
        self._note(self._last, entries.DaemonEnded(self._clock.monotonic(), safe))
        self.flush()
        with self._lock, suppress(OSError):
            ring, self._ring = self._ring, None
            self._again_at = NEVER
            if ring is not None:
                ring.close(ended=safe and not self._dead)

    def _note(self, *entry: Any) -> None:
        self._waiting.append(entry)
        self._news = True

    def flush(self) -> None:
        if not self._news and len(self._waiting) < SAME_AT_ONCE:
            return
        if self._lock.acquire(blocking=False):  # if not, another thread flushes
            try:
                self._drain()
            except Exception as error:  # noqa: BLE001 - logged by _failed
                self._failed(error)
            finally:
                self._lock.release()

    def look(self) -> None:
        with self._lock:
            now = self._clock.monotonic()
            if self._ring is not None and not self._ring.lives:
                self._failed(FileNotFoundError(f"{self._ring.path} was removed"))
                self._again_at = now
            if self._ring is None and now >= self._again_at:
                self._open(now)
        self._news = True  # so that repeated readings are written within a second
        self.flush()

    def _open(self, now: float) -> None:
        self._again_at = now + AGAIN_S
        try:
            self._ring = self._make()
        except OSError as error:
            self._once.failed("recording", error)
        else:
            self._once.works("recording")

    def _failed(self, error: Exception) -> None:
        self._once.failed("recording", error)
        ring, self._ring = self._ring, None
        self._fresh()
        if ring is not None:
            with suppress(OSError):
                ring.close(ended=True)  # only the ring ends here, and the daemon continues

    def _fresh(self) -> None:
        """Reset the writer's state for an empty ring."""
        self._subjects: dict[str, KnownSubject] = {}
        self._out = bytearray()
        self._same: dict[str, KnownSubject] = {}
        self._known_at = AGES_AGO
        self._may_speak, self._spoken_at, self._lost = MOST_SPOKEN_PER_S, AGES_AGO, 0
        self._offset_s = 0.0

    def _drain(self) -> None:
        waiting, self._news = self._waiting, False
        if self._ring is None:
            waiting.clear()
            return
        self._tell_time()
        while waiting:
            take, *what = waiting.popleft()
            take(*what)
        self._write()

    def _tell_time(self) -> None:
        """Write the wall clock's time if that clock was set. Every KNOWN_EVERY_S, write all known state
        instead."""
        now = self._clock.monotonic()
        offset_s = self._clock.wall() - now
        stepped = abs(offset_s - self._offset_s) > STEP_S
        if stepped:
            self._offset_s = offset_s
        if now >= self._known_at + KNOWN_EVERY_S:
            self._know(now)
        elif stepped:
            self._put(Clocks(now, now + offset_s))

    def _step(
        self, name: str, before: object, event: object, now: float, decision: AnyDecision
    ) -> None:
        subject = self._subjects.get(name)
        if subject is None or subject.memory is not before:
            subject = self._anew(name, before, now)
        is_reading = type(event) in (Sampled, IoFailed)
        news = decision.report.news()
        if is_reading and subject.is_as_before(event, decision, news):
            subject.memory, subject.report = decision.memory, decision.report
            self._again(name, subject, now)
            return
        self._say_same(name)
        self._put(step(name, subject, event, now, decision, news))
        subject.memory, subject.outputs = decision.memory, decision.outputs
        subject.report, subject.news = decision.report, news
        if is_reading:
            subject.reading = event

    def _anew(self, name: str, memory: object, now: float) -> KnownSubject:
        self._say_same(name)
        self._put(known(name, KnownSubject(memory), now, anew=True))
        self._subjects[name] = subject = KnownSubject(memory)
        return subject

    def _again(self, name: str, subject: KnownSubject, now: float) -> None:
        subject.times.append(now)
        self._same[name] = subject
        if len(subject.times) == SAME_AT_ONCE:
            self._say_same(name)

    def _say_same(self, name: str) -> None:
        """Write the times at which the last reading was repeated. `_fits` always reserves room for this
        entry in the segment."""
        subject = self._same.pop(name, None)
        if subject is not None:
            times, subject.times = subject.times, []
            self._append(Same(times[-1], name, struct.pack(f"<{len(times)}d", *times)))

    def _published(self, name: str, memory: object, now: float) -> None:
        subject = self._subjects.get(name)
        if subject is not None:
            self._say_same(name)
            self._put(Published(now, name))
            subject.memory = memory

    def _forgotten(self, name: str, now: float) -> None:
        if self._subjects.pop(name, None) is not None:
            self._put(SubjectForgotten(now, name))

    def _spoken(
        self, now: float, topic: str, message: Message, sent: bool, sender: Sender | None
    ) -> None:
        if not self._may_keep(now):
            self._lost += 1
            return
        release, kind = self._release(), type(message)
        sample = cdr.encode(kind, message, release)
        node = sender.node[:LONGEST_NAME] if sender else ""
        self._put(Spoken(now, sent, topic, type_name(kind), release.name, sample, node))

    def _may_keep(self, now: float) -> bool:
        """Return whether the rate of messages is low enough to record one more message."""
        gained = MOST_SPOKEN_PER_S * (now - self._spoken_at)
        self._may_speak = min(MOST_SPOKEN_PER_S, self._may_speak + gained)
        self._spoken_at = now
        if self._may_speak < 1.0:
            return False
        self._may_speak -= 1.0
        if self._lost:
            lost, self._lost = self._lost, 0
            self._put(entries.EntriesLost(now, lost))
        return True

    def _last(self, entry: AnyEntry) -> None:
        """Append the ring's last entry. First write the entries of repeated readings."""
        self._say_all_same()
        self._put(entry)

    def _say_all_same(self) -> None:
        for name in list(self._same):
            self._say_same(name)

    def _put(self, entry: AnyEntry) -> None:
        """Append an entry. If the entry does not fit into the segment, first begin the next segment."""
        assert self._ring is not None
        content = entries.encode(entry)
        if len(content) > self._ring.room // 2:
            self._put(entries.EntriesLost(entry.at, 1))
            return
        if not self._fits(len(content)):
            self._next_segment(entry.at)
        self._frame(content)

    def _append(self, entry: AnyEntry) -> None:
        self._frame(entries.encode(entry))

    def _frame(self, content: bytes) -> None:
        assert self._ring is not None
        self._out += self._ring.frame(content)

    def _fits(self, length: int) -> bool:
        assert self._ring is not None
        reserved = (LONGEST_SAME + FRAME.size) * (len(self._same) + 1)
        return self._ring.fits(len(self._out) + length + FRAME.size + reserved)

    def _know(self, now: float) -> None:
        """Write all known state into this segment. If the segment has too little room, begin the next
        segment with it."""
        self._say_all_same()
        known = self._all_known(now)
        if not self._fits(sum(len(content) + FRAME.size for content in known)):
            self._next_segment(now)
            return
        self._known_at = now
        for content in known:
            self._frame(content)

    def _next_segment(self, now: float) -> None:
        """Begin the next segment with the known state. If the state would fill more than half of the
        segment, leave out the subjects that do not fit."""
        assert self._ring is not None
        self._say_all_same()
        self._write()
        self._ring.begin_segment()
        self._known_at, room = now, self._ring.room // 2
        for content in self._all_known(now):
            room -= len(content) + FRAME.size
            if room >= 0:
                self._frame(content)

    def _all_known(self, now: float) -> list[bytes]:
        clocks = Clocks(now, now + self._offset_s)
        all_known = [known(name, seen, now) for name, seen in self._subjects.items()]
        return [entries.encode(clocks), *map(entries.encode, all_known)]

    def _write(self) -> None:
        if self._out and self._ring is not None:
            self._ring.write(bytes(self._out))
            self._out.clear()
