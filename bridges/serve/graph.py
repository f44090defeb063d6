"""A kind without hardware in service: its cores' memories, and their place on the RMF graph.

It has the loop's face towards the daemon, and one thread, which waits on the inbox until some core
wants to be woken. It only listens until it has been alone on its topics for the kind's quiet time; only
then does it declare its publishers, so that a node that waits for another's end is no rival to it.
"""

import logging
import math
import random
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from bridges.core.decision import OperatorReset, RequestRefused
from bridges.core.graph_kind import GraphKind, MaySpeak, Woken
from bridges.log import pairs
from bridges.rmf.definitions import Message
from bridges.rmf.stamps import stamp
from bridges.rmf.topics import Topic
from bridges.rmf.transport import Publisher, Subscription, Transport, TransportError
from bridges.serve.device import Clock
from bridges.serve.loop import LEAST_GAP_S, Inbox
from bridges.serve.subject import Subject

log = logging.getLogger(__name__)

LOOK_EVERY_S = 0.25
"""How often to look who else is on the graph."""
SPREAD_LEAST_S, SPREAD_MOST_S = 0.5, 3.0
"""How much longer one listens that has met a rival: more than discovery takes, and never alike."""
MAX_SUBJECTS = 1000
"""More lifts or doors than any site has: somebody makes names up."""

TOGETHER_EVERY_S = 1.0
TOGETHER_GAP_S = 0.1


class Kept(Protocol):
    """What outlives the daemon: one file, or nothing yet. `write` replaces it whole; both may raise
    OSError."""

    def read(self) -> bytes | None: ...

    def write(self, kept: bytes) -> None: ...


def _same(topic: Topic[Any]) -> Topic[Any]:
    return topic


class GraphNode:
    """Serves one GraphKind. `named`: a topic under the site's own name for it.

    `scans` counts finished rounds, for the watchdog. Beside `round` and `status`, its public face is
    that of `bridges.serve.loop.Loop`.
    """

    def __init__(
        self,
        kind: GraphKind,
        settings: Any,
        transport: Transport,
        clock: Clock,
        named: Callable[[Topic[Any]], Topic[Any]] = _same,
        kept: Kept | None = None,
    ) -> None:
        self.name = kind.name
        self.inbox = Inbox()
        self.scans = 0
        self.safe = True
        self.refused: Counter[str] = Counter()
        self.subjects: dict[str, Subject] = {}
        self.may_speak = False
        self.rivals = 0
        self._kind = kind
        self._settings = settings
        self._limits = kind.limits(settings)
        self._transport = transport
        self._clock = clock
        self._named = named
        self._publishers: dict[str, Publisher[Any]] = {}
        self._rival_ends: list[Subscription] = []
        self._started_at = clock.monotonic()
        self._alone_since: float | None = None
        self._spread_s = 0.0
        self._look_at = -math.inf
        self._kept = kept
        self._kept_bytes: bytes | None = None
        self._told_together: Message | None = None
        self._told_at = self._tell_at = -math.inf
        self._stopping = self._reset = False
        self._restore()
        self._thread = threading.Thread(target=self._run, name=f"graph-{kind.name}", daemon=True)

    def subscribe(self) -> None:
        """Begin to hear. What is retained for us comes at once."""
        for topic in self._kind.sole:
            end = self._transport.subscribe(self._named(topic), _ignore, others_only=True)
            self._rival_ends.append(end)
        for topic in self._kind.requests:
            others_only = topic in self._kind.publishes
            self._transport.subscribe(
                self._named(topic), self._to_inbox(topic), others_only=others_only
            )

    def reset(self) -> None:
        """An operator says that latched faults may clear; from any thread."""
        self._reset = True
        self.inbox.wake()

    def start(self) -> None:
        """Begin to serve."""
        self._thread.start()

    def stop(self, timeout_s: float) -> bool:
        """End after the round under way; False if it does not end."""
        self._stopping = True
        self.inbox.wake()
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    @property
    def alive(self) -> bool:
        """False when it has ended, by stop or by a defect of ours."""
        return self._thread.is_alive()

    @property
    def ready(self) -> bool:
        """It listens. (A passive node is in order: the other one speaks.)"""
        return self.scans > 0

    @property
    def wake_at(self) -> float:
        """When the next round is due if nothing is heard."""
        tells = self.may_speak and self._kind.together is not None
        tell_at = self._tell_at if tells else math.inf
        return min(
            [self._look_at, tell_at, *(subject.wake_at for subject in self.subjects.values())]
        )

    def round(self) -> None:
        """Take what was heard, wake whose time has come, send what they say."""
        self._look_around(self._clock.monotonic())
        for name, messages in self.inbox.take().items():
            for topic, message in messages:
                self._receive(name, topic, message)
        if self._reset:
            self._reset = False
            self._decide_all(OperatorReset())
        now = self._clock.monotonic()
        for subject in list(self.subjects.values()):
            if now >= subject.wake_at:
                self._decide(subject, Woken())
            if subject.idle(now):
                del self.subjects[subject.name]
        self._keep_and_tell(now)
        self.scans += 1

    def status(self) -> Mapping[str, Any]:
        """For the status file: how it stands on the graph."""
        return {
            "passive": not self.may_speak,
            "other_publishers": self.rivals,
            "refused": dict(self.refused),
        }

    @property
    def nodes(self) -> list[Subject]:
        """The subjects, each with a `name` and a `status` of its own."""
        return list(self.subjects.values())

    def _run(self) -> None:
        while not self._stopping:
            self.inbox.wait(max(self.wake_at - self._clock.monotonic(), LEAST_GAP_S))
            self.round()

    def _to_inbox(self, topic: Topic[Any]) -> Callable[[Any], None]:
        """A callback for the transport's thread."""

        def put(message: Any) -> None:
            self.inbox.put((self._kind.device_name(message), (topic, message)))

        return put

    def _look_around(self, now: float) -> None:
        """Who else publishes what only one may? Nobody, for the quiet time: then we may."""
        if now < self._look_at:
            return
        rivals = sum(end.matched() for end in self._rival_ends)
        self._log_rivals(rivals)
        self.rivals = rivals
        if rivals:
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = now
        quiet_s = self._quiet_s + self._spread_s
        speak_at = math.inf if self._alone_since is None else self._alone_since + quiet_s
        self._look_at = min(at for at in (now + LOOK_EVERY_S, speak_at) if at > now)
        self._set_may_speak(now >= speak_at)

    @property
    def _quiet_s(self) -> float:
        return self._kind.quiet_s(self._settings)

    def _log_rivals(self, rivals: int) -> None:
        if rivals and not self.rivals:
            log.warning(pairs("passive", kind=self.name, reason="another node does the same"))
        elif self.rivals and not rivals:
            log.info(pairs("other_node_gone", kind=self.name))

    def _set_may_speak(self, yes: bool) -> None:
        if yes == self.may_speak:
            return
        if yes:
            for topic in self._kind.publishes:
                self._publishers[topic.name] = self._transport.publisher(self._named(topic))
            log.info(pairs("active", kind=self.name))
        else:
            self._withdraw()
        self.may_speak = yes
        self._decide_all(MaySpeak(yes))

    def _restore(self) -> None:
        """What was kept; a file that cannot be right is as good as none, and says so."""
        if self._kept is None or self._kind.restore is None:
            return
        try:
            kept = self._kept.read()
            if kept is None:
                return
            found = self._kind.restore(kept, self._settings, self._started_at)
        except (OSError, ValueError) as error:
            log.error(pairs("not_restored", kind=self.name, reason=error))
            return
        self._kept_bytes = kept
        for name, memory in found.items():
            self._subject(name, memory)

    def _keep_and_tell(self, now: float) -> None:
        """Keep what must outlive us, then tell of all subjects together."""
        if self._kind.persist is None and self._kind.together is None:
            return
        memories = {name: subject.memory for name, subject in self.subjects.items()}
        self._keep(memories)
        if self._kind.together is None or not self.may_speak:
            return
        topic, message = self._kind.together(memories)
        changed = message != self._told_together
        self._tell_at = self._told_at + (TOGETHER_GAP_S if changed else TOGETHER_EVERY_S)
        if now >= self._tell_at:
            self._publish(topic, message)
            self._told_together, self._told_at = message, now
            self._tell_at = now + TOGETHER_EVERY_S

    def _keep(self, memories: Mapping[str, Any]) -> None:
        if self._kept is None or self._kind.persist is None:
            return
        kept = self._kind.persist(memories)
        if kept == self._kept_bytes:
            return
        self._kept_bytes = kept
        try:
            self._kept.write(kept)
        except OSError as error:
            log.error(pairs("not_kept", kind=self.name, reason=error))

    def _withdraw(self) -> None:
        """Be no rival to the other. Two that began at once both do; one is back before the other."""
        for publisher in self._publishers.values():
            publisher.close()
        self._publishers.clear()
        self._spread_s = random.uniform(SPREAD_LEAST_S, SPREAD_MOST_S)

    def _receive(self, name: str, topic: Topic[Any], message: Any) -> None:
        try:
            event = self._kind.requests[topic](message, self._settings, self._clock.wall())
            subject = self._subject(name)
        except RequestRefused as refusal:
            self._refuse(refusal.kind, refusal.detail)
            return
        self._decide(subject, event)

    def _subject(self, name: str, memory: Any = None) -> Subject:
        """What this message is about; it may be new to us."""
        if name in self.subjects:
            return self.subjects[name]
        if len(self.subjects) == MAX_SUBJECTS:
            raise RequestRefused("too many names", name)
        subject = Subject(name, self._kind, self._limits, self._started_at, self._clock)
        subject.memory = subject.memory if memory is None else memory
        self.subjects[name] = subject
        self._decide(subject, MaySpeak(self.may_speak))
        return subject

    def _decide(self, subject: Subject, event: Any) -> None:
        publish, refused = subject.decide(event)
        for topic, message in publish:
            self._publish(topic, message)
        if refused:
            self._refuse(refused, subject.name, event)

    def _decide_all(self, event: Any) -> None:
        for subject in self.subjects.values():
            self._decide(subject, event)

    def _publish(self, topic: Topic[Any], message: Message) -> None:
        now = stamp(self._clock.wall())
        try:
            self._publishers[topic.name].publish(self._kind.stamped(message, now))
        except TransportError as error:
            log.error(pairs("not_published", topic=topic.name, reason=error))

    def _refuse(self, kind: str, *detail: object) -> None:
        """Count it, and log the first of each kind."""
        self.refused[kind] += 1
        if self.refused[kind] == 1:
            log.warning(pairs("refused", kind=kind, detail=": ".join(map(str, detail))))


def _ignore(message: Any) -> None:
    """A rival is counted, not listened to."""
