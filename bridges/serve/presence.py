"""Decides whether a node without hardware may publish: only one serves a graph, any other only listens.

A node publishes after it has been alone on its topics for the kind's quiet time. Only then are its
publishers declared, so that a waiting node is not counted as a rival.
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
"""How often to look for other nodes on the graph."""
SPREAD_LEAST_S, SPREAD_MOST_S = 0.5, 3.0
"""Extra listening time after meeting a rival: longer than discovery takes, and random."""


class Presence:
    """Looks for rivals. `kind`: for the log. `rivals`: how many other nodes publish our topics."""

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
        """Count the publishers of these topics from now on."""
        self._ends += [transport.subscribe(topic, _ignore, others_only=True) for topic in sole]

    def look(self, now: float) -> None:
        """Look, if it is due."""
        if now < self.look_at:
            return
        self._count(now)
        alone_since = NEVER if self._alone_since is None else self._alone_since
        speak_at = alone_since + self._quiet_s + self._spread_s
        self.look_at = min(at for at in (now + LOOK_EVERY_S, speak_at) if at > now)
        self._set(now >= speak_at)

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

    def _set(self, yes: bool) -> None:
        """Two nodes that began at once both fall silent; by chance one returns before the other."""
        if yes == self.may_speak:
            return
        self.may_speak = yes
        if yes:
            log.info(pairs("active", kind=self._kind))
        else:
            self._spread_s = random.uniform(SPREAD_LEAST_S, SPREAD_MOST_S)


def _ignore(message: Message) -> None:
    """The messages do not matter: rivals are only counted."""
