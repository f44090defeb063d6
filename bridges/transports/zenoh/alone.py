"""Keeps a node on this machine. If a zenoh router connects to the node, the node leaves the ROS graph.
Otherwise the router would forward the node's messages to other machines. The node returns
GONE_AFTER_S after the router has disconnected."""

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
    """A rule that decides whether one node must be off the ROS graph. `now`: the time (monotonic s)."""

    def __init__(self) -> None:
        self._met_at = -math.inf

    def away(self, router: bool, now: float) -> bool:
        """Return whether the node must be off the graph now. `router`: Is a router connected to the
        node?"""
        if router:
            self._met_at = now
        return router or now < self._met_at + GONE_AFTER_S
