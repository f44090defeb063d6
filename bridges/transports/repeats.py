"""Recognises retained messages that a subscription has delivered before.

A publisher sends its retained messages to each subscription that it does not know. After a gap in the
network, or when our node joins again, it does not know ours. So the end of last week's alarm would come
once more, and would end the alarm of today.
"""

from collections.abc import Hashable
from typing import Final

from bridges.messages.definitions import Message
from bridges.messages.topics import AnyTopic

MOST: Final = 2000
"""The maximum number of messages in memory. Above this number, the message that was heard longest ago
is forgotten. It would be delivered again."""


class Repeats:
    """The messages that one subscription has delivered. A topic without retained messages has no
    repeats."""

    def __init__(self, topic: AnyTopic) -> None:
        self._retained = topic.subscribe.durability == "transient_local"
        self._known: dict[int, None] = {}

    def has(self, sent: Hashable, message: Message) -> bool:
        """Note a message that has arrived. Return whether the same message has arrived before.

        `sent`: what the protocol says about the sending of this message, and repeats with the message,
        such as its time in ns. If it says nothing, `sent` is None or 0, and the message counts as new.
        """
        if not (self._retained and sent):
            return False
        key = hash((sent, message))
        before = key in self._known
        self._known.pop(key, None)
        self._known[key] = None
        if len(self._known) > MOST:
            del self._known[next(iter(self._known))]
        return before
