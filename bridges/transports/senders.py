"""The publishers of received messages: looked up only for a listener that wants to tell them apart."""

import time
from collections.abc import Callable, Hashable
from functools import partial
from typing import Final

from bridges.messages.heard import Sender

MOST: Final = 1000
"""The limit of remembered publishers; beyond it the one heard longest ago is forgotten."""
AGAIN_S: Final = 1.0
"""The pause (s) between two looks for the node of a publisher."""


class Senders:
    """The publishers that one transport has heard, by their identities on its wire.

    Before a subscription hands on a message, it sets `key`, the identity of the publisher (None
    if unknown), and `node_of`, which finds the node of an identity ("" if unknown). That is all for a
    daemon, which never asks.
    """

    def __init__(self) -> None:
        self.key: Hashable = None
        self.node_of: Callable[[Hashable], str] = lambda _: ""
        self._known: dict[Hashable, Sender] = {}
        self._look_at: dict[Hashable, float] = {}

    def now(self) -> Sender | None:
        """Return the publisher of the message that is being handed on."""
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
