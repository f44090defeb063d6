"""A node's publishers, by topic."""

import logging
from collections.abc import Callable, Iterable

from bridges.log import pairs
from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic
from bridges.rmf.transport import Publisher, Transport, TransportError

log = logging.getLogger(__name__)

Named = Callable[[Topic[Message]], Topic[Message]]
"""Renames a topic as the site's YAML says."""


class Outlet:
    """Publishers that are declared and withdrawn together."""

    def __init__(self, transport: Transport, named: Named) -> None:
        self._transport = transport
        self._named = named
        self._ends: dict[str, Publisher[Message]] = {}

    def open(self, topics: Iterable[Topic[Message]]) -> None:
        """Declare them. Raises TransportError."""
        for topic in topics:
            self._ends[topic.name] = self._transport.publisher(self._named(topic))

    def publish(self, topic: Topic[Message], message: Message) -> None:
        """Publish. A failure is logged: the next message may get through."""
        try:
            self._ends[topic.name].publish(message)
        except TransportError as error:
            log.error(pairs("not_published", topic=topic.name, reason=error))

    def heard_by(self) -> dict[str, int]:
        """The number of subscriptions that receive each topic, by the topic's name."""
        return {name: end.matched() for name, end in self._ends.copy().items()}

    def close(self) -> None:
        """Withdraw every publisher."""
        for end in self._ends.values():
            end.close()
        self._ends.clear()
