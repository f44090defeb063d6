"""The loop: one bus and the devices on it.

RMF's callbacks put events into the inbox. A GPIO edge, or a change of an input on a device's other bus,
wakes the loop. A round scans each device that is due, has events, or may have changed. First come the
devices that answered last time, then the other devices, the longest overdue first. A round ends after
one silent device. So a live device's reading is never older than its period plus one silent device's
timeout, even in the first rounds. When a device falls silent, the loop also loses the time of the
device's retries, once. When the loop ends, for any cause, it switches every output off, beginning with
the devices that answer.
"""

import logging
from collections.abc import Collection, Sequence

from bridges.kinds.shared.durations import AGES_AGO, NEVER
from bridges.runtime.clock import Clock
from bridges.runtime.device import AnyNode
from bridges.runtime.inbox import Inbox
from bridges.runtime.other_bus import InputReader
from bridges.runtime.ring_writer import NOBODY, NoWriter
from bridges.runtime.serving import LEAST_GAP_S
from bridges.system.log import pairs
from drivers.hal import Bus

log = logging.getLogger(__name__)

SUSPENDED_S = 0.5
"""The delay (s) after which a loop was suspended, if it woke so late without waiting for its bus."""


class Loop:
    """The loop of one bus. It scans each node every `scan_s` (s), and at the node's `wake_at`."""

    def __init__(
        self,
        bus_name: str,
        bus: Bus,
        nodes: Sequence[AnyNode | InputReader],
        scan_s: float,
        clock: Clock,
        writer: NoWriter = NOBODY,
    ) -> None:
        self.name = f"bus-{bus_name}"
        self.nodes = nodes
        self.inbox: Inbox[object] = Inbox()
        self._bus_name = bus_name
        self._bus = bus
        self._scan_s = scan_s
        self._clock = clock
        self._writer = writer
        self._due = {node.name: node.wake_at for node in nodes}
        self._edge = False
        self._ran_at = NEVER
        self._scans = 0
        bus.on_edge(self.stir)

    @property
    def wake_at(self) -> float:
        """The time at which the next device is due (monotonic s)."""
        return min(self._due.values())

    @property
    def finished(self) -> int:
        """The number of finished scans and bus calls. Failed calls count too."""
        return self._scans + self._bus.calls

    @property
    def ready(self) -> bool:
        """Return whether every device has been tried once and has published its first state."""
        return all(node.ready for node in self.nodes)

    def round(self) -> None:
        """Scan the devices that are due."""
        self._notice_suspension()
        self._take_edge()
        self._scan_in_turn(self.inbox.waiting())
        self._writer.flush()
        if self.inbox.closed:
            return
        self._bus.scanned()
        self._ran_at = self._clock.monotonic()

    def end(self) -> bool:
        """Switch every output off and release the bus. Return False if an output is not verified
        off."""
        self._bus.insist()
        safe = [node.make_safe() for node in self._in_turn()]
        for node in self.nodes:
            node.close()
        self._bus.close()
        log.info(pairs("outputs_off", bus=self._bus_name, verified=all(safe)))
        return all(safe)

    def _notice_suspension(self) -> None:
        """Tell every node if the process was stopped or the machine slept during the loop's idle
        time."""
        late_s = self._clock.monotonic() - max(self.wake_at, self._ran_at)
        if late_s > SUSPENDED_S:
            log.warning(pairs("suspended", bus=self._bus_name, for_s=f"{late_s:.1f}"))
            for node in self.nodes:
                node.was_suspended(late_s)

    def _scan_in_turn(self, asked: Collection[str]) -> None:
        """Scan the devices that are due or in `asked`. Stop after the first silent device."""
        for node in self._in_turn():
            if self.inbox.closed:
                return
            if node.name in asked or self._is_due(node):
                calls = self._bus.calls
                self._scan(node)
                if not node.answers and self._bus.calls > calls:
                    return

    def _in_turn(self) -> list[AnyNode | InputReader]:
        """Return the nodes in their order: first the nodes that answer, in the YAML's order, then the
        other nodes, the longest overdue first."""
        others = [node for node in self.nodes if not node.answers]
        others.sort(key=lambda node: self._due[node.name])
        return [node for node in self.nodes if node.answers] + others

    def _scan(self, node: AnyNode | InputReader) -> None:
        started = self._clock.monotonic()
        node.scan(self.inbox.take_for(node.name))
        self._scans += 1
        next_at = min(node.wake_at, started + self._scan_s)
        self._due[node.name] = max(next_at, started + LEAST_GAP_S)

    def _is_due(self, node: AnyNode | InputReader) -> bool:
        return self._clock.monotonic() >= self._due[node.name]

    def stir(self) -> None:
        """Make every device due, because an input may have changed. For any thread."""
        self._edge = True
        self.inbox.wake()

    def _take_edge(self) -> None:
        """Make every device due after an edge. If the edge comes during a round, the next round scans
        the devices."""
        if self._edge:
            self._edge = False
            self._due = dict.fromkeys(self._due, AGES_AGO)
