"""Two supervisors start at the same moment, as after a power cut. In the end one must be active, and
the other must be passive."""

from collections import deque
from collections.abc import Callable
from typing import Any

from bridges.kinds.lift_supervisor import KIND
from bridges.kinds.lift_supervisor.settings import LiftSupervisorSettings
from bridges.messages.topics import Topic
from bridges.runtime.clock import Clock
from bridges.runtime.graph_node import GraphNode
from bridges.transports.transport import Subscription
from tests.transports.memory import MemoryNetwork, MemoryTransport

DISCOVERY_S = 0.3
STEP_S = 0.05


class Late:
    """A subscription that sees publishers come and go DISCOVERY_S late, as on a real network."""

    def __init__(self, end: Subscription) -> None:
        self._end = end
        self._seen: deque[int] = deque([0], maxlen=round(DISCOVERY_S / STEP_S))

    def look(self) -> None:
        self._seen.append(self._end.matched())

    def matched(self) -> int:
        return self._seen[0]

    def senders(self) -> list[str]:
        return self._end.senders()


class LateTransport(MemoryTransport):
    """A transport that sees other nodes come and go DISCOVERY_S late."""

    def __init__(self, network: MemoryNetwork, name: str) -> None:
        super().__init__(network, name)
        self.ends: list[Late] = []

    def subscribe(  # type: ignore[override]
        self, topic: Topic[Any], received: Callable[[Any], None], *, others_only: bool = False
    ) -> Late:
        self.ends.append(Late(super().subscribe(topic, received, others_only=others_only)))
        return self.ends[-1]


def test_of_two_supervisors_that_start_at_once_exactly_one_serves_in_the_end() -> None:
    now = 0.0
    network = MemoryNetwork()
    transports = [LateTransport(network, name) for name in ("one", "two")]
    clock = Clock(lambda: now, lambda: now)
    nodes = [
        GraphNode(KIND, LiftSupervisorSettings(), transport, clock) for transport in transports
    ]
    for node in nodes:
        node.subscribe()
    speaking: list[int] = []
    while now < 60.0:
        for transport in transports:
            for end in transport.ends:
                end.look()
        for node in nodes:
            node.round()
        speaking.append(sum(node.presence.may_speak for node in nodes))
        now += STEP_S
    assert 2 in speaking, "the two did not begin at once"
    assert set(speaking[round(30.0 / STEP_S) :]) == {1}
