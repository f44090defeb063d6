"""When a node that must stay on this machine is off the graph: while a router is linked to it, which
would forward what it says, and for a while after that."""

import math
from typing import Final

ROUTER_MET: Final = "ROUTER_ON_LOOPBACK"
WHY_AWAY: Final = (
    "a router has connected to this machine's nodes, and would forward what must stay here: until it"
    " has gone this node neither speaks nor hears"
)
GONE_AFTER_S: Final = 10.0
"""A router without its link tries to connect every 4 s (zenoh's default for `connect/retry`); one that
restarts takes a few seconds more."""


class Alone:
    """`now`: monotonic seconds."""

    def __init__(self) -> None:
        self._met_at = -math.inf

    def away(self, router: bool, now: float) -> bool:
        """Must the node be off the graph? `router`: is one linked to it now?"""
        if router:
            self._met_at = now
        return router or now < self._met_at + GONE_AFTER_S
