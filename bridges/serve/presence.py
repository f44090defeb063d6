"""Whether a node without hardware may speak: one alone serves a graph, any other one only listens.

It has been alone on its topics for the kind's quiet time before it says a word; only then are its
publishers declared, so that a node that waits for another's end is no rival to it.
"""

import logging
import random
from collections.abc import Iterable

from bridges.core.durations import AGES_AGO, NEVER
from bridges.log import pairs
from bridges.rmf.definitions import Message
from bridges.rmf.topics import Topic
from bridges.rmf.transport import Subscription, Transport

log = logging.getLogger(__name__)

LOOK_EVERY_S = 0.25
"""How often to look who else is on the graph."""
SPREAD_LEAST_S, SPREAD_MOST_S = 0.5, 3.0
"""How much longer one listens that has met a rival: more than discovery takes, and never alike."""


class Presence:
    """Looks for rivals. `kind`: for the log. `rivals`: how many others publish what one alone may."""

    def __init__(self, kind: str, quiet_s: float) -> None:
        self.may_speak = False
        self.rivals = 0
        self.look_at = AGES_AGO
        self._kind = kind
        self._quiet_s = quiet_s
        self._spread_s = 0.0
        self._alone_since: float | None = None
        self._ends: list[Subscription] = []

    def listen(self, transport: Transport, sole: Iterable[Topic[Message]]) -> None:
        """Count from now on who publishes these topics."""
        self._ends += [transport.subscribe(topic, _ignore, others_only=True) for topic in sole]

    def look(self, now: float) -> bool:
        """Look, if it is time to. True when `may_speak` has changed."""
        if now < self.look_at:
            return False
        self._count(now)
        alone_since = NEVER if self._alone_since is None else self._alone_since
        speak_at = alone_since + self._quiet_s + self._spread_s
        self.look_at = min(at for at in (now + LOOK_EVERY_S, speak_at) if at > now)
        return self._set(now >= speak_at)

    def _count(self, now: float) -> None:
        before, self.rivals = self.rivals, sum(end.matched() for end in self._ends)
        if self.rivals:
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = now
        if self.rivals and not before:
            log.warning(pairs("passive", kind=self._kind, reason="another node does the same"))
        elif before and not self.rivals:
            log.info(pairs("other_node_gone", kind=self._kind))

    def _set(self, yes: bool) -> bool:
        """Two that began at once both fall silent; one is back before the other."""
        if yes == self.may_speak:
            return False
        self.may_speak = yes
        if yes:
            log.info(pairs("active", kind=self._kind))
        else:
            self._spread_s = random.uniform(SPREAD_LEAST_S, SPREAD_MOST_S)
        return True


def _ignore(message: Message) -> None:
    """A rival is counted, not listened to."""
