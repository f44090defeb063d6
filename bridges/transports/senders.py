"""The publishers of received messages. A transport looks up a publisher only when a listener asks for
it."""

import time
from collections.abc import Callable, Hashable
from functools import partial
from typing import Final

from bridges.messages.heard import Sender

MOST: Final = 1000
"""The maximum number of publishers in memory. Above this number, the publisher that was silent longest
is forgotten."""
AGAIN_S: Final = 1.0
"""The pause (s) between two attempts to find the node of a publisher."""


class Senders:
    """The publishers that one transport has heard. The key is the publisher's identity in the
    transport's protocol.

    Before a subscription delivers a message, it sets two attributes here. `key` is the publisher's
    identity, or None if unknown. `node_of(key)` returns the publisher's node, or "" if unknown.

    Only `now` looks up a node. A daemon that never calls `now` has no further work.
    """

    def __init__(self) -> None:
        self.key: Hashable = None
        self.node_of: Callable[[Hashable], str] = lambda _: ""
        self._known: dict[Hashable, Sender] = {}
        self._look_at: dict[Hashable, float] = {}

    def now(self) -> Sender | None:
        """Return the publisher of the message that the subscription now delivers."""
        key = self.key
        if key is None:
            return None
        sender = self._known[key] = self._known.pop(key) if key in self._known else Sender()
        if not sender.node and time.monotonic() >= self._look_at.get(key, 0.0):
            self._look_at[key] = time.monotonic() + AGAIN_S
            sender.look = partial(self.node_of, key)
            sender.node = sender.look()
        if len(self._known) > MOST:
            oldest = next(iter(self._known))
            del self._known[oldest], self._look_at[oldest]
        return sender
