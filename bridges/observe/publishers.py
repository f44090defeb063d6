"""The publishers of one device's states. If two publishers alternate, two nodes use the name of one
device."""

from bridges.messages.heard import Sender
from bridges.observe.limits import MOST_SENDERS, SLOWEST_S


class StatePublishers:
    """The publishers of the states in the last SLOWEST_S, with the latest publisher last. At most
    MOST_SENDERS are kept.

    A node that restarts is a new publisher. A listener that joins the ROS graph again may also see new
    publishers. In both cases the old publisher publishes nothing after the new publisher has begun.
    Therefore only one of the two publishes at a time.
    """

    def __init__(self) -> None:
        self._last: dict[Sender, float] = {}
        self._back_at = float("-inf")

    def hear(self, sender: Sender | None, now: float) -> None:
        """Note that this publisher has sent a state."""
        if sender is None:
            return
        newest = next(reversed(self._last), sender)
        last = self._last.pop(sender, float("-inf"))
        if newest is not sender and now - last <= SLOWEST_S:
            self._back_at = now
        if len(self._last) == MOST_SENDERS:
            oldest = next(iter(self._last))
            if now - self._last[oldest] <= SLOWEST_S:
                return  # somebody may invent publishers, and these must not replace a real publisher
            del self._last[oldest]
        self._last[sender] = now

    def at(self, now: float) -> tuple[Sender, ...]:
        """Return the publishers at this time. Return several only if two nodes publish. Return nothing
        if the publisher is unknown."""
        lately = tuple(one for one, last in self._last.items() if now - last <= SLOWEST_S)
        return lately if now - self._back_at <= SLOWEST_S else lately[-1:]
