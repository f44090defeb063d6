"""Log lines about samples and other nodes. All transports use these lines. Each sort of problem is
logged once for each topic."""

import logging

from bridges.messages.cdr import CdrError
from bridges.messages.definitions import Message
from bridges.messages.topics import AnyTopic
from bridges.system.log import pairs
from bridges.transports.transport import Receive

log = logging.getLogger(__name__)

FAILURES = 5
"""The number of successive failed reads after which a transport ends its thread. Then the daemon ends
too."""
NOT_HEARD = "a publisher is not heard"
NOT_SERVED = "a subscription is not served"


def drop(dropped: dict[str, int], topic: AnyTopic, error: CdrError) -> None:
    """Count an invalid sample. Log the first invalid sample of each topic."""
    dropped[topic.name] = dropped.get(topic.name, 0) + 1
    if dropped[topic.name] == 1:
        log.warning(pairs("sample_dropped", topic=topic.name, reason=error, further="only counted"))


def hand_on(dropped: dict[str, int], topic: AnyTopic, received: Receive, message: Message) -> None:
    """Deliver a message to its subscriber. If the callback raises, only this message is lost."""
    try:
        received(message)
    except Exception as error:
        dropped[topic.name] = dropped.get(topic.name, 0) + 1
        if dropped[topic.name] == 1:
            why = f"a defect: {type(error).__name__}: {error}"
            text = pairs("sample_dropped", topic=topic.name, reason=why, further="only counted")
            log.error(text, exc_info=True)


def misfit(topic: AnyTopic, text: str, policy: str) -> None:
    """Log the QoS policy that keeps a peer from matching our end of a topic."""
    log.warning(pairs("misfit", topic=topic.name, reason=f"{text}: its {policy} does not fit ours"))
