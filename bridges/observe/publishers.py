"""The publishers of one device's states: two at once are two nodes under one name."""

from bridges.messages.heard import Sender
from bridges.observe.limits import MOST_SENDERS, SLOWEST_S


class StatePublishers:
    """The publishers of the states in the last SLOWEST_S, the latest last; at most MOST_SENDERS.

    A restarted node is a new publisher, and a listener that joins again may see new ones. Neither is
    two at once: the old publisher never comes back after the new one.
    """

    def __init__(self) -> None:
        self._last: dict[Sender, float] = {}
        self._back_at = float("-inf")

    def hear(self, sender: Sender | None, now: float) -> None:
        """Take a state of this publisher."""
        if sender is None:
            return
        newest = next(reversed(self._last), sender)
        last = self._last.pop(sender, float("-inf"))
        if newest is not sender and now - last <= SLOWEST_S:
            self._back_at = now
        if len(self._last) == MOST_SENDERS:
            oldest = next(iter(self._last))
            if now - self._last[oldest] <= SLOWEST_S:
                return  # made-up publishers do not displace a real one
            del self._last[oldest]
        self._last[sender] = now

    def at(self, now: float) -> tuple[Sender, ...]:
        """Return the publishers of this moment: one, several at once, or none if unknown."""
        lately = tuple(one for one, last in self._last.items() if now - last <= SLOWEST_S)
        return lately if now - self._back_at <= SLOWEST_S else lately[-1:]
