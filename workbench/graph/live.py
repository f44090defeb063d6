"""A live graph as a stream of `Heard`. The readers of recordings give the same kind of stream."""

import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import Final

from bridges.messages import topics
from bridges.messages.definitions import OF_WORKCELLS, PACKAGES, Message
from bridges.messages.heard import Heard, bounded
from bridges.messages.topics import AnyTopic
from bridges.transports.transport import Subscription, Transport, TransportError

OF_DEVICES: Final[tuple[AnyTopic, ...]] = (
    topics.LIFT_STATES,
    topics.LIFT_REQUESTS,
    topics.ADAPTER_LIFT_REQUESTS.live(),
    topics.DOOR_STATES,
    topics.DOOR_REQUESTS,
    topics.ADAPTER_DOOR_REQUESTS,
    topics.DOOR_SUPERVISOR_HEARTBEAT,
    topics.CHARGER_STATES,
    topics.CHARGER_REQUESTS,
    topics.CHARGER_CANCELS,
    topics.CHARGER_REFUSALS,
    topics.ADAPTER_CHARGER_REQUESTS,
    topics.ADAPTER_CHARGER_CANCELS,
    topics.DISPENSER_STATES,
    topics.DISPENSER_REQUESTS,
    topics.DISPENSER_RESULTS,
    topics.INGESTOR_STATES,
    topics.INGESTOR_REQUESTS,
    topics.INGESTOR_RESULTS,
    topics.DIAGNOSTICS,
    topics.FIRE_ALARM_TRIGGER,
    topics.EMERGENCY_SIGNAL,
)
"""Topics about devices. The subscriptions to requests and states are volatile, so that no retained
request looks like a new request. Only the alarm topics deliver retained messages, because an alarm
lasts until a later message ends it."""


def subscribed(
    transport: Transport,
    heard: Iterable[AnyTopic],
    receiver: Callable[[AnyTopic], Callable[[Message], None]],
    *,
    others_only: bool = False,
) -> dict[str, Subscription]:
    """Subscribe to these topics. Return topic -> subscription. If a ROS machine lacks the message
    packages of dispensers and ingestors, leave out the topics of these devices."""
    ends: dict[str, Subscription] = {}
    for topic in heard:
        try:
            ends[topic.name] = transport.subscribe(topic, receiver(topic), others_only=others_only)
        except TransportError:
            if PACKAGES[topic.type] not in OF_WORKCELLS:
                raise
    return ends


def require_life(transport: Transport) -> None:
    """Raise TransportError if the transport's thread has ended. No more messages would come."""
    if not transport.lives:
        raise TransportError("the transport's thread has ended")


class Ear:
    """A listener that hears these topics from now on. With `others_only`, it does not hear the messages
    that its own transport sends. `ends` is topic -> subscription."""

    def __init__(
        self,
        transport: Transport,
        heard: Iterable[AnyTopic] = OF_DEVICES,
        *,
        others_only: bool = False,
    ) -> None:
        self._transport = transport
        self._waiting: SimpleQueue[Heard] = SimpleQueue()
        self.ends = subscribed(
            transport,
            heard,
            lambda topic: partial(self._received, topic.name),
            others_only=others_only,
        )

    def _received(self, topic: str, message: Message) -> None:
        at, wall = time.monotonic(), time.time()
        self._waiting.put(Heard(at, wall, topic, bounded(message), self._transport.sender()))

    def listen(self, timeout_s: float) -> list[Heard]:
        """Return all messages that have arrived, in order. Wait up to `timeout_s` for the first
        message.

        Raises TransportError after the last message of a transport whose thread has ended. Otherwise
        the graph would seem to be silent.
        """
        heard = list[Heard]()
        with suppress(Empty):
            heard.append(self._waiting.get(timeout=max(0.0, timeout_s)))
            while True:
                heard.append(self._waiting.get_nowait())
        if not heard:
            require_life(self._transport)
        return heard
