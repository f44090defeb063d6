"""The publishers of one node, by topic."""

import logging
import threading
from collections.abc import Callable, Iterable

from bridges.kinds.shared.decision import Fault
from bridges.messages.cdr import CdrError
from bridges.messages.definitions import Alert, Message
from bridges.messages.fallbacks import INSTEAD, converted
from bridges.messages.heard import Sender
from bridges.messages.topics import Topic
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.runtime_directory import Once
from bridges.system.log import pairs
from bridges.transports.transport import Publisher, Transport, TransportError

log = logging.getLogger(__name__)

Named = Callable[[Topic[Message]], Topic[Message]]
"""A function that returns a topic under its name in the site's YAML."""


class Outlet:
    """The publishers of one node. They are declared only while the node may publish.

    If RMF's release lacks a message, the outlet publishes a substitute
    (`bridges/messages/fallbacks.py`). An alarm and its end are published on the same topic, even if the
    release changes in between.
    """

    def __init__(self, transport: Transport, named: Named, writer: NoWriter = NOBODY) -> None:
        self._transport = transport
        self._named = named
        self._writer = writer
        self._own = Sender(f"/{transport.name}")
        self._ends: dict[str, Publisher[Message]] = {}
        self._instead: set[str] = set()
        self._once = Once("not_published", "published_again", "topic", logging.ERROR)
        self._lock = threading.Lock()

    def open(self, topics: Iterable[Topic[Message]]) -> None:
        """Declare publishers for the topics that RMF's release has. Raises TransportError."""
        for topic in topics:
            if self._transport.release.has(topic.type):
                self._end(topic)

    def publish(self, topic: Topic[Message], message: Message) -> bool:
        """Publish a message. Return False if the message was not sent, or cannot be encoded. Then the
        node has a fault until a later message of the topic is sent."""
        way, wanted = self._way(topic, message)
        if wanted is None:
            if isinstance(message, Alert):
                log.warning(pairs("alert", title=message.title, message=message.message))
            return True
        try:
            self._end(way).publish(wanted)
        except (TransportError, CdrError) as error:
            self.failed(topic, error)
            return False
        self._once.works(topic.name)
        self._writer.spoken(self._named(way).name, wanted, sent=True, sender=self._own)
        return True

    def failed(self, topic: Topic[Message], error: Exception) -> None:
        """Note that a message was not published. Log only the first of successive failures on a
        topic."""
        self._once.failed(topic.name, error)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """The fault NOT_PUBLISHED for each topic whose last message was not sent. Any thread may read
        this."""
        failing = sorted(self._once.wrong.copy().items())
        return tuple(Fault("NOT_PUBLISHED", f"{topic}: {why}") for topic, why in failing)

    def _way(
        self, topic: Topic[Message], message: Message
    ) -> tuple[Topic[Message], Message | None]:
        """Return the topic and the message to send. Return None for the message if it must only be
        logged."""
        if self._transport.release.has(topic.type) and topic.name not in self._instead:
            return topic, message
        if topic.name in INSTEAD:
            self._instead.add(topic.name)
        return INSTEAD.get(topic.name, topic), converted(message)

    def _end(self, topic: Topic[Message]) -> Publisher[Message]:
        with self._lock:
            if topic.name not in self._ends:
                self._ends[topic.name] = self._transport.publisher(self._named(topic))
            return self._ends[topic.name]

    def heard_by(self) -> dict[str, int]:
        """Return the number of subscriptions to each topic, by the topic's name."""
        return {name: end.matched() for name, end in self._ends.copy().items()}

    def close(self, topics: Iterable[Topic[Message]] | None = None) -> None:
        """Withdraw the publishers of these topics. If `topics` is None, withdraw all publishers."""
        names = list(self._ends) if topics is None else [topic.name for topic in topics]
        for end in [self._ends.pop(name, None) for name in names]:
            if end is not None:
                end.close()
