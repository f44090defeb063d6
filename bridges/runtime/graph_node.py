"""Serves a kind without hardware, such as a supervisor. A subject is one lift, door or site that the
node serves. The node keeps a memory for each subject, and publishes on RMF's ROS graph.

A round takes the messages that have arrived, wakes the subjects whose time has come, and publishes
their messages. The daemon runs the rounds in a thread (`bridges/runtime/serving.py`). Tests run the
rounds in virtual time.
"""

import logging
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Generic

from bridges.kinds.shared.decision import Fault, M, OperatorReset, R, RequestRefused
from bridges.kinds.shared.durations import NEVER
from bridges.kinds.shared.graph_kind import GraphEvent, GraphKind, MaySpeak, Woken
from bridges.kinds.shared.kind import E, L, S
from bridges.messages.definitions import Message
from bridges.messages.stamps import ClockError, stamp
from bridges.messages.topics import Topic
from bridges.runtime.answers import RefusalAnswers
from bridges.runtime.clock import Clock
from bridges.runtime.inbox import Inbox
from bridges.runtime.keeper import Keeper, MemoryStore
from bridges.runtime.outlet import Named, Outlet
from bridges.runtime.presence import Presence
from bridges.runtime.refusals import Refusals
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.subject import Status, Subject, SubjectCore
from bridges.system.log import pairs
from bridges.transports.transport import Subscription, Transport

log = logging.getLogger(__name__)

MAX_SUBJECTS = 1000
"""The maximum number of subjects. No site has more lifts or doors, so somebody must have invented
further names."""
MAX_UNSHOWN = 100
"""The maximum number of lifts or doors that publish no state. Only requests name such devices."""
MAX_REQUESTERS = 10_000
"""The maximum number of requesters, without those of lifts and doors in the YAML. No site has so many
robots. Without this limit invented requesters would accumulate, because the node never forgets a
holder."""
FORGETS_EVERY_S = 1.0
"""The least time (s) between two looks for subjects that may be forgotten. A look at each message would
cost the supervisor of 200 doors more than the messages."""
DEFECT = "a defect"


def _core(kind: GraphKind[S, L, M, E, R], limits: L) -> SubjectCore[M, GraphEvent[E], None, R]:
    """Return the kind's core. Its faults are compared by code and detail, because the detail names the
    subject."""

    def itself(fault: Fault) -> Fault:
        return fault

    return SubjectCore(
        "subject",
        lambda memory, event, now: kind.decide(memory, event, now, limits),
        kind.summary,
        itself,
    )


def _same(topic: Topic[Message]) -> Topic[Message]:
    return topic


class GraphNode(Generic[S, L, M, E, R]):
    """The node that serves one GraphKind. `named(topic)` returns a topic under its name in the site's
    YAML."""

    def __init__(
        self,
        kind: GraphKind[S, L, M, E, R],
        settings: S,
        transport: Transport,
        clock: Clock,
        named: Named = _same,
        kept: MemoryStore | None = None,
        writer: NoWriter = NOBODY,
    ) -> None:
        self.name = f"graph-{kind.name}"
        self.inbox: Inbox[tuple[Topic[Message], E]] = Inbox()
        self.presence = Presence(kind.name, kind.quiet_s(settings))
        on = ", ".join(topic.name for topic in kind.yields)
        self.alone = Presence(f"{kind.name} on {on}", 0.0) if on else None
        self.subjects: dict[str, Subject[M, GraphEvent[E], None, R]] = {}
        self._kind = kind
        self._settings = settings
        self._core = _core(kind, kind.limits(settings))
        self._transport = transport
        self._clock = clock
        self._named = named
        self._writer = writer
        self._outlet = Outlet(transport, named, writer)
        self._refusals = Refusals()
        self._answers = RefusalAnswers()
        self._keeper = Keeper(kind, kept, self._publish)
        self._knows_since = started_at = clock.monotonic()
        self._orders: deque[OperatorReset | E] = deque()
        self._may = MaySpeak(False, alone=self.alone is None)
        self._hears: dict[str, Subscription] = {}
        self._unsaid: list[tuple[Topic[Message], Message]] = []
        self._shown: set[str] = set()
        self._reserved = frozenset(kind.reserved(settings))
        self._requesters = 0
        self._forget_at = started_at
        for name, memory in self._keeper.restore(settings, started_at).items():
            self._add(name, memory)

    def subscribe(self) -> None:
        """Subscribe to every topic. Retained messages arrive at once."""
        self.presence.listen(self._transport, map(self._named, self._kind.sole))
        if self.alone:
            self.alone.listen(self._transport, map(self._named, self._kind.yields))
        for topic in self._kind.requests:
            others_only = topic in self._kind.publishes
            hear = self._to_inbox(topic)
            self._hears[topic.name] = self._transport.subscribe(
                self._named(topic), hear, others_only=others_only
            )

    def obey(self, order: OperatorReset | E) -> None:
        """Pass a person's order to every subject. Any thread may call this."""
        self._orders.append(order)
        self.inbox.wake()

    @property
    def finished(self) -> int:
        """The number of finished steps within a round. It is always 0, because this node does not count
        steps."""
        return 0

    @property
    def ready(self) -> bool:
        """Return True. This holds even if another node does the work, and this node must not
        publish."""
        return True

    @property
    def wake_at(self) -> float:
        """The time (monotonic s) of the next round if no message arrives before."""
        due = (subject.wake_at for subject in self.subjects.values())
        looks = [look.look_at for look in (self.presence, self.alone) if look]
        answers_at = self._answers.due_at if self.presence.may_speak else NEVER
        return min(*looks, self._keeper.wake_at, answers_at, *due)

    def round(self) -> None:
        """Take the messages that have arrived, wake the subjects that are due, and publish."""
        self._look_around()
        for name, events in self.inbox.take().items():
            for topic, event in events:
                self._receive(name, topic, event)
        while self._orders:
            self._decide_all(self._orders.popleft())
        self._wake()
        self._forget()
        memories = {name: subject.memory for name, subject in self.subjects.items()}
        now = self._clock.monotonic()
        self._keeper.keep(self._real(memories), now)
        self._say()
        if self.presence.may_speak:
            self._answers.say(now, self._kind.answer, self._publish)
        self._keeper.tell(memories, now, self.presence.may_speak)
        self._writer.flush()

    def end(self) -> bool:
        """Return True, because the node has no output to switch off."""
        return True

    @property
    def refused(self) -> dict[str, int]:
        """The number of refused requests, by reason."""
        return self._refusals.counts()

    def status(self) -> Status:
        """Return the node's part of the status file: whether it must not publish, rival publishers,
        refusals, faults, connections."""
        return {
            "passive": not self.presence.may_speak,
            "other_publishers": self.presence.rivals,
            "refused": self.refused,
            **self._answers.status(),
            "faults": [{"code": f.code, "detail": f.detail} for f in self._faults()],
            "heard_by": self._heard_by(),
            "hears": {name: end.matched() for name, end in self._hears.items()},
        }

    def _faults(self) -> tuple[Fault, ...]:
        return *self.presence.faults, *self._outlet.faults, *self._keeper.faults

    def devices(self) -> Mapping[str, Status]:
        """Return each subject's status by name, for the status file. Any thread may call this
        method."""
        return {subject.name: subject.status() for subject in list(self.subjects.values())}

    def _to_inbox(self, topic: Topic[Message]) -> Callable[[Message], None]:
        """Return a callback that puts accepted messages into the inbox. The transport's thread calls
        it."""

        heard_on = self._named(topic).name

        def put(message: Message) -> None:
            sender = self._transport.sender()
            self._writer.spoken(heard_on, message, sent=False, sender=sender)
            with self._counting(topic.name, message):
                event = self._kind.requests[topic](message, self._settings, self._clock.wall())
                self.inbox.put(self._kind.device_name(message), (topic, event))

        return put

    @contextmanager
    def _counting(self, about: str, message: object = None) -> Iterator[None]:
        """Count a refused message. Also count an unexpected exception of our own code, after which the
        core's memory is unchanged."""
        try:
            yield
        except RequestRefused as refusal:
            self._refusals.add(refusal.kind, refusal.detail)
            if message is not None:
                self._answers.add(message, str(refusal))
        except Exception as error:
            if not self._refusals.counts().get(DEFECT):
                log.exception(pairs("defect", kind=self._kind.name, about=about, reason=error))
            self._refusals.add(DEFECT, f"{type(error).__name__} about {about}")

    def _look_around(self) -> None:
        """Declare our publishers if we may publish. Otherwise withdraw the publishers."""
        for look in filter(None, (self.presence, self.alone)):
            look.look(self._clock.monotonic())
        may = self._may_speak()
        if may == self._may:
            return
        self._may = may
        if may.yes or may.at_once:
            silent = () if may.alone else self._kind.yields
            topics = dict.fromkeys((*self._kind.publishes, *self._kind.sole))
            self._outlet.close(silent)
            self._outlet.open(topic for topic in topics if topic not in silent)
        else:
            self._outlet.close()
        self._decide_all(may)

    def _may_speak(self) -> MaySpeak:
        alone = self.alone is None or self.alone.may_speak
        presence = self.presence
        return MaySpeak(presence.may_speak, self._must_at_once(), alone, presence.waits)

    def _must_at_once(self) -> bool:
        """Return whether a subject must publish at once, although the node only listens after its
        start. Return False if a rival node publishes."""
        if self.presence.may_speak or self.presence.rivals:
            return False
        return any(self._kind.urgent(subject.memory) for subject in self.subjects.values())

    def _heard_by(self) -> dict[str, int]:
        """Return the number of subscriptions to each of our topics, by the topic's name."""
        names = {topic.name for topic in self._kind.publishes}
        return {name: n for name, n in self._outlet.heard_by().items() if name in names}

    def _wake(self) -> None:
        now = self._clock.monotonic()
        for subject in [one for one in self.subjects.values() if now >= one.wake_at]:
            self._decide(subject, Woken())

    def _forget(self) -> None:
        """Forget the subjects of which nothing has been heard for long."""
        now = self._clock.monotonic()
        if now < self._forget_at:
            return
        self._forget_at = now + FORGETS_EVERY_S
        for subject in list(self.subjects.values()):
            if self._kind.idle(subject.memory, now):
                self._requesters -= self._remembered(subject)
                del self.subjects[subject.name]
                self._knows_since = now
                self._writer.forgotten(subject.name, now)
                self._shown.discard(subject.name)

    def _receive(self, name: str, topic: Topic[Message], event: E) -> None:
        with self._counting(name):
            subject = self._subject(name, shows_itself=self._kind.shown_by in (None, topic))
            self._require_room(subject, self._kind.requester(event))
            self._decide(subject, event)

    def _subject(self, name: str, shows_itself: bool) -> Subject[M, GraphEvent[E], None, R]:
        """Return the subject with this name. Make a new subject for a new name. Raises RequestRefused
        if too many names are known."""
        if name not in self.subjects and not self._has_room(name, shows_itself):
            raise RequestRefused("too many names", name)
        if shows_itself:
            self._shown.add(name)
        found = self.subjects.get(name)
        return found or self._add(name, self._kind.initial(name, self._knows_since))

    def _has_room(self, name: str, shows_itself: bool) -> bool:
        """Return whether this name can be added. The limits keep room for the names in the YAML and for
        names that publish states, because somebody may invent other names."""
        if name in self._reserved:
            return True
        if shows_itself:
            return len(self._shown) < MAX_SUBJECTS
        return len(self.subjects) - len(self._shown) < MAX_UNSHOWN

    def _require_room(self, subject: Subject[M, GraphEvent[E], None, R], who: str) -> None:
        """Raise RequestRefused for a new requester if MAX_REQUESTERS are already known."""
        full = who and self._requesters >= MAX_REQUESTERS and subject.name not in self._reserved
        if full and who not in self._kind.requesters(subject.memory):
            raise RequestRefused("too many requesters", f"{who} at {subject.name}")

    def _remembered(self, subject: Subject[M, GraphEvent[E], None, R]) -> int:
        """Return the number of the subject's requesters. Return 0 for a subject that the YAML names,
        because its core limits the number."""
        if subject.name in self._reserved:
            return 0
        return len(self._kind.requesters(subject.memory))

    def _real(self, memories: Mapping[str, M]) -> Mapping[str, M]:
        """Return the memories to write. If there are too many names without a published state, leave
        these names out. Otherwise the next start would restore all invented names."""
        if len(memories) - len(self._shown) < MAX_UNSHOWN:
            return memories
        real = self._shown | self._reserved
        return {name: memory for name, memory in memories.items() if name in real}

    def _add(self, name: str, memory: M) -> Subject[M, GraphEvent[E], None, R]:
        refusals, clock = self._refusals, self._clock
        say, writer = self._will_say, self._writer
        subject = Subject(name, memory, self._core, say, refusals, clock, writer)
        self.subjects[name] = subject
        self._requesters += self._remembered(subject)
        self._decide(subject, self._may)
        return subject

    def _decide(self, subject: Subject[M, GraphEvent[E], None, R], event: GraphEvent[E]) -> None:
        before = self._remembered(subject)
        decision = subject.decide(event)
        if decision.refused:
            self._answers.add(event, decision.refused)
        subject.log(decision.report)
        self._requesters += self._remembered(subject) - before

    def _decide_all(self, event: GraphEvent[E]) -> None:
        for subject in self.subjects.values():
            self._decide(subject, event)

    def _will_say(self, topic: Topic[Message], message: Message) -> None:
        """Hold the message back until the round has written the memories to disk."""
        self._unsaid.append((topic, message))

    def _say(self) -> None:
        unsaid, self._unsaid = self._unsaid, []
        for topic, message in unsaid:
            self._publish(topic, message)

    def _publish(self, topic: Topic[Message], message: Message) -> None:
        """Publish a message. Its stamp is the present time."""
        try:
            stamped = self._kind.stamped(message, stamp(self._clock.wall()))
        except ClockError as error:
            self._outlet.failed(topic, error)
            return
        self._outlet.publish(topic, stamped)


AnyGraphNode = GraphNode[Any, Any, Any, Any, Any]
"""A node of a kind that was found by name. Therefore the type checker does not know its types."""
