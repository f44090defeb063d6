"""A transport on which topics have the names that a site has given them (`rmf.topics` of a YAML)."""

from collections.abc import Callable, Mapping
from typing import TypeVar

from bridges.messages.definitions import Message
from bridges.messages.releases import Release
from bridges.messages.topics import Topic
from bridges.transports.transport import Publisher, Subscription, Transport

M = TypeVar("M", bound=Message)


class Renamed:
    """`Transport`. `names`: RMF's topic name -> the site's."""

    def __init__(self, transport: Transport, names: Mapping[str, str]) -> None:
        self.name, self.speaks, self.dropped = transport.name, transport.speaks, transport.dropped
        self.domain_id = transport.domain_id
        self.wall, self.close = transport.wall, transport.close
        self._transport = transport
        self._names = names

    def publisher(self, topic: Topic[M]) -> Publisher[M]:
        """Declare a publisher under the site's name."""
        return self._transport.publisher(self._named(topic))

    def subscribe(
        self, topic: Topic[M], received: Callable[[M], None], *, others_only: bool = False
    ) -> Subscription:
        """Declare a subscription under the site's name."""
        return self._transport.subscribe(self._named(topic), received, others_only=others_only)

    @property
    def release(self) -> Release:
        """The release of RMF's messages that it speaks now."""
        return self._transport.release

    def faults(self) -> list[tuple[str, str]]:
        """(code, detail) of what now keeps this node and others from hearing each other."""
        return self._transport.faults()

    @property
    def lives(self) -> bool:
        """Whether its thread runs."""
        return self._transport.lives

    def _named(self, topic: Topic[M]) -> Topic[M]:
        return topic.named(self._names.get(topic.name, topic.name))
