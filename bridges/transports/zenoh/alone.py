"""Keeps a node on this machine. If a router is linked to such a node, the node leaves the graph,
because the router would forward its messages to other machines. The node returns some time after the
router has gone."""

import math
from typing import Final

ROUTER_MET: Final = "ROUTER_ON_LOOPBACK"
WHY_AWAY: Final = (
    "a router has connected to this machine's nodes, and would forward messages that must stay here:"
    " until the router has gone, this node neither speaks nor hears"
)
GONE_AFTER_S: Final = 10.0
"""The time (s) without a router after which the node returns to the graph.

A router that has lost its link tries to connect every 4 s (zenoh's default for `connect/retry`). A
router that restarts needs a few seconds more.
"""


class Alone:
    """The decision whether one node must be off the graph. `now`: the time (monotonic s)."""

    def __init__(self) -> None:
        self._met_at = -math.inf

    def away(self, router: bool, now: float) -> bool:
        """Return whether the node must be off the graph now. `router`: a router is linked to the
        node."""
        if router:
            self._met_at = now
        return router or now < self._met_at + GONE_AFTER_S
