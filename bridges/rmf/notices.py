"""What a transport says of its peers, in the same words on each wire: once, and not each time."""

import logging

from bridges.log import pairs
from bridges.rmf.cdr import CdrError
from bridges.rmf.topics import AnyTopic

log = logging.getLogger(__name__)

NOT_HEARD = "a publisher is not heard"
NOT_SERVED = "a subscription is not served"


def drop(dropped: dict[str, int], topic: AnyTopic, error: CdrError) -> None:
    """Count a sample that is no message, and log the first of its topic."""
    dropped[topic.name] = dropped.get(topic.name, 0) + 1
    if dropped[topic.name] == 1:
        log.warning(pairs("sample_dropped", topic=topic.name, reason=error, further="only counted"))


def misfit(topic: AnyTopic, text: str, policy: str) -> None:
    """Say which policy keeps a peer apart from our end of a topic."""
    log.warning(pairs("misfit", topic=topic.name, reason=f"{text}: its {policy} does not fit ours"))
