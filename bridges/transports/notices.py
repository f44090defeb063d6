"""Log lines about samples and other nodes. All transports use these lines. Each sort of problem is
logged once for each topic."""

import logging
import math
from typing import Final

from bridges.messages.cdr import CdrError
from bridges.messages.definitions import Message
from bridges.messages.topics import AnyTopic
from bridges.system.log import pairs
from bridges.transports.transport import Receive

log = logging.getLogger(__name__)

FAILURES: Final = 5
"""The number of successive failed reads after which a transport ends its thread. Then the daemon ends
too."""
CALM_S: Final = 10.0
"""The time (s) without a failed read after which a transport forgets the earlier ones. It is longer
than the time in which a node joins again and hears of all other nodes. So the same failure after each
joining is not taken for a new one."""
NOT_HEARD = "a publisher is not heard"
NOT_SERVED = "a subscription is not served"


class Failures:
    """The failed reads of a transport's thread, of which each came less than CALM_S after the one
    before."""

    def __init__(self) -> None:
        self._count = 0
        self._last_at = -math.inf

    def count(self, now: float) -> None:
        """Count a failed read. `now`: the time (s) on a clock that never steps."""
        self._count = 1 if now - self._last_at >= CALM_S else self._count + 1
        self._last_at = now

    @property
    def too_many(self) -> bool:
        """Return whether the transport must end its thread."""
        return self._count >= FAILURES


def drop(dropped: dict[str, int], topic: AnyTopic, error: CdrError) -> None:
    """Count an invalid sample. Log the first invalid sample of each topic."""
    dropped[topic.name] = dropped.get(topic.name, 0) + 1
    if dropped[topic.name] == 1:
        log.warning(pairs("sample_dropped", topic=topic.name, reason=error, further="only counted"))


def skip(dropped: dict[str, int], name: str, error: Exception) -> None:
    """Count an announcement of another node that cannot be read. Log the first of each topic. `name`:
    the name of DDS's or ROS's own topic for announcements."""
    dropped[name] = dropped.get(name, 0) + 1
    if dropped[name] == 1:
        text = pairs("announcement_skipped", topic=name, reason=error, further="only counted")
        log.warning(text)


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
