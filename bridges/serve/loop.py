"""The loop: one bus and the devices on it.

RMF callbacks and GPIO edges only put something into the inbox. A round scans each device that is due,
has something in the inbox, or may have changed; and every output is made safe at the end, however that
comes.
"""

import logging
from collections.abc import Sequence

from bridges.core.durations import AGES_AGO, NEVER
from bridges.log import pairs
from bridges.serve.clock import Clock
from bridges.serve.device import AnyNode
from bridges.serve.inbox import Inbox
from bridges.serve.serving import LEAST_GAP_S
from drivers.hal import Bus

log = logging.getLogger(__name__)

SUSPENDED_S = 0.5
"""A loop that wakes later than this after its time, with no bus to wait for, did not run meanwhile."""


class Loop:
    """Scans the nodes of one bus, each once in `scan_s` (s) and whenever it asks for it."""

    def __init__(
        self, bus_name: str, bus: Bus, nodes: Sequence[AnyNode], scan_s: float, clock: Clock
    ) -> None:
        self.name = f"bus-{bus_name}"
        self.nodes = nodes
        self.inbox: Inbox[object] = Inbox()
        self._bus_name = bus_name
        self._bus = bus
        self._scan_s = scan_s
        self._clock = clock
        self._due = dict.fromkeys((node.name for node in nodes), AGES_AGO)
        self._edge = False
        self._ran_at = NEVER
        self._scans = 0
        bus.on_edge(self._on_edge)

    @property
    def wake_at(self) -> float:
        """When the next device is due."""
        return min(self._due.values())

    @property
    def finished(self) -> int:
        """How much it has done so far: calls of its bus, good or bad, and scans. A call that hangs
        does not count."""
        return self._scans + self._bus.calls

    @property
    def ready(self) -> bool:
        """Every device has been tried once and its first state is out."""
        return all(node.ready for node in self.nodes)

    def round(self) -> None:
        """Scan whatever is due."""
        self._notice_suspension()
        events = self.inbox.take()
        everything = self._take_edge()
        for node in self.nodes:
            if self.inbox.closed:
                return
            if everything or node.name in events or self._is_due(node):
                self._scan(node, events.get(node.name, ()))
        self._bus.scanned()
        self._ran_at = self._clock.monotonic()

    def end(self) -> bool:
        """Every output off, and the bus let go."""
        self._bus.insist()
        safe = [node.make_safe() for node in self.nodes]
        for node in self.nodes:
            node.close()
        self._bus.close()
        log.info(pairs("outputs_off", bus=self._bus_name, verified=all(safe)))
        return all(safe)

    def _notice_suspension(self) -> None:
        """Has the process been stopped, or the machine slept, while nothing was to be done?"""
        late_s = self._clock.monotonic() - max(self.wake_at, self._ran_at)
        if late_s > SUSPENDED_S:
            log.warning(pairs("suspended", bus=self._bus_name, for_s=f"{late_s:.1f}"))
            for node in self.nodes:
                node.was_suspended(late_s)

    def _scan(self, node: AnyNode, events: Sequence[object]) -> None:
        started = self._clock.monotonic()
        node.scan(events)
        self._scans += 1
        next_at = min(node.wake_at, started + self._scan_s)
        self._due[node.name] = max(next_at, started + LEAST_GAP_S)

    def _is_due(self, node: AnyNode) -> bool:
        return self._clock.monotonic() >= self._due[node.name]

    def _on_edge(self) -> None:
        self._edge = True
        self.inbox.wake()

    def _take_edge(self) -> bool:
        """Was there an edge? One that comes meanwhile is of this round, or rings for the next."""
        if not self._edge:
            return False
        self._edge = False
        return True
