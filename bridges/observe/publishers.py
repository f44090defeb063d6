"""The publishers of one device's states. Two nodes have one name if two publishers take turns."""

from bridges.messages.heard import Sender
from bridges.observe.limits import MOST_SENDERS, SLOWEST_S


class StatePublishers:
    """The publishers of the states in the last SLOWEST_S, the latest last. At most MOST_SENDERS are
    kept.

    A node that restarts is a new publisher. A listener that joins the graph again may see new
    publishers too. In both cases the old publisher never comes back after the new publisher, so only
    one of the two publishes at a time.
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
                return  # invented publishers must not displace a real one
            del self._last[oldest]
        self._last[sender] = now

    def at(self, now: float) -> tuple[Sender, ...]:
        """Return the publishers at this time. Return several only if two nodes publish, and none if the
        publisher is unknown."""
        lately = tuple(one for one, last in self._last.items() if now - last <= SLOWEST_S)
        return lately if now - self._back_at <= SLOWEST_S else lately[-1:]
