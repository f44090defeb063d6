"""The publishers of one device's states. If two publish at the same time, two nodes have one name."""

from bridges.messages.heard import Sender
from bridges.observe.limits import MOST_SENDERS, SLOWEST_S


class StatePublishers:
    """The publishers of the states in the last SLOWEST_S, the latest last; at most MOST_SENDERS.

    A restarted node is a new publisher, and a listener that joins again may see new publishers. In both
    cases only one publishes at a time, because the old publisher never comes back after the new one.
    """

    def __init__(self) -> None:
        self._last: dict[Sender, float] = {}
        self._back_at = float("-inf")

    def hear(self, sender: Sender | None, now: float) -> None:
        """Note that this publisher sent a state."""
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
        """Return the publishers at this time: one, several if two nodes publish, or none if unknown."""
        lately = tuple(one for one, last in self._last.items() if now - last <= SLOWEST_S)
        return lately if now - self._back_at <= SLOWEST_S else lately[-1:]
