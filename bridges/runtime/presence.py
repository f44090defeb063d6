"""Decides whether a node without hardware may publish, because only one such node may serve RMF's ROS
graph. A rival is another node that publishes on our topics.

At first a node only listens. It may publish when it has seen no rival on its topics during the kind's
quiet time. It declares its publishers only then, so a node that still listens does not count as a
rival.
"""

import logging
import random
from collections.abc import Iterable
from typing import Final

from bridges.kinds.shared.decision import Fault
from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.kinds.shared.graph_kind import LISTENS
from bridges.messages.definitions import Message
from bridges.messages.topics import Topic
from bridges.messages.words import LONGEST_NAME, printable
from bridges.system.log import pairs
from bridges.transports.transport import Subscription, Transport

log = logging.getLogger(__name__)

LOOK_EVERY_S = 0.25
"""The interval (s) between two looks for other nodes on the graph."""
MOST_NAMED: Final = 3
SPREAD_LEAST_S, SPREAD_MOST_S = 0.5, 3.0
"""The limits (s) of a random time. A node that has met a rival listens longer by this random time. Even
the smallest random time is longer than discovery takes."""


class Presence:
    """The watch for rivals. `kind`: a name for the log.

    `rivals`: the number of other nodes' publishers on our topics. `rivals_do`: a text about the rivals
    and their topics, such as `/desk publishes lift_requests`, or "" without rivals.
    """

    def __init__(self, kind: str, quiet_s: float) -> None:
        self.may_speak = False
        self.rivals = 0
        self.rivals_do = ""
        self.look_at = AGES_AGO
        self._kind = kind
        self._quiet_s = quiet_s
        self._spread_s = 0.0
        self._alone_since: float | None = None
        self._ends: dict[str, Subscription] = {}

    def listen(self, transport: Transport, sole: Iterable[Topic[Message]]) -> None:
        """Begin to count the publishers of these topics."""
        for topic in sole:
            self._ends[topic.name] = transport.subscribe(topic, _ignore, others_only=True)

    @property
    def waits(self) -> str:
        """Return the reason why this node does not publish. It is a text for requesters that wait for
        this node."""
        return f"while {self.rivals_do}" if self.rivals else LISTENS

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Return the fault PASSIVE if a rival keeps this node from publishing. This is a fault, because
        the rival may not do this node's work."""
        if not self.rivals:
            return ()
        return (Fault("PASSIVE", f"{self.rivals_do}, so this node only listens"),)

    def look(self, now: float) -> None:
        """Look for rivals, if LOOK_EVERY_S has passed or the quiet time has ended."""
        if now < self.look_at:
            return
        self._count(now)
        alone_since = NEVER if self._alone_since is None else self._alone_since
        speak_at = alone_since + self._quiet_s + self._spread_s
        self.look_at = min(at for at in (now + LOOK_EVERY_S, speak_at) if at > now)
        self._set(now >= speak_at)

    def _count(self, now: float) -> None:
        before, did = self.rivals, self.rivals_do
        self.rivals = sum(end.matched() for end in self._ends.values())
        self.rivals_do = self._named() if self.rivals else ""
        if self.rivals:
            self._alone_since = None
        elif self._alone_since is None:
            self._alone_since = now
        if self.rivals and self.rivals_do != did:
            log.warning(pairs("passive", kind=self._kind, reason=self.rivals_do))
        elif before and not self.rivals:
            log.info(pairs("other_node_gone", kind=self._kind))

    def _named(self) -> str:
        heard = {topic: end for topic, end in self._ends.items() if end.matched()}
        names = sorted({name for end in heard.values() for name in end.senders()})
        who = " and ".join(printable(name[:LONGEST_NAME]) for name in names[:MOST_NAMED])
        return f"{who or 'another node'} publishes {' and '.join(heard)}"

    def _set(self, yes: bool) -> None:
        """Start or stop publishing. After a stop, draw a random time for the next quiet time. Without
        it, two nodes that began at the same time would stop and start together."""
        if yes == self.may_speak:
            return
        self.may_speak = yes
        if yes:
            log.info(pairs("active", kind=self._kind))
        else:
            self._spread_s = random.uniform(SPREAD_LEAST_S, SPREAD_MOST_S)


def _ignore(message: Message) -> None:
    """Ignore a rival's message, because only the number of rivals matters."""
