"""The loop of one bus and the devices on the bus.

RMF's callbacks put events into the loop's inbox. A GPIO edge wakes the loop. If a device also has
inputs on another bus, a change of these inputs wakes the loop too.

A round scans each device that is due, has events, or may have changed. The devices that answered last
time come first. The other devices follow, the longest overdue first.

A round ends after one silent device. So a reading of a live device is at most as old as its period plus
one silent device's timeout. This holds even in the first rounds. When a device falls silent, the bus
repeats its calls, and this one round takes longer by these retries.

When the loop ends, for any reason, it switches every output off. The devices that answer come first.
"""

import logging
from collections.abc import Collection, Sequence
from typing import Any

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
"""The minimum delay (s) of a wake-up that proves that the process was suspended. Only the delay while
the loop sleeps counts. A slow bus does not count."""


class Loop:
    """The loop of one bus. It scans each node every `scan_s` (s), and also at the node's `wake_at`."""

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
        self.bus_name = bus_name
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
        """The time (monotonic s) at which the next device is due."""
        return min(self._due.values())

    @property
    def finished(self) -> int:
        """The number of finished scans and bus calls. Failed calls count too."""
        return self._scans + self._bus.calls

    def calls(self) -> dict[str, dict[str, Any]]:
        """Return the counts of the bus's calls by unit, for the status file."""
        return self._bus.units.status()

    @property
    def ready(self) -> bool:
        """Return whether every device was tried once and has published its first state."""
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
        log.info(pairs("outputs_off", bus=self.bus_name, verified=all(safe)))
        return all(safe)

    def _notice_suspension(self) -> None:
        """Tell every node that the process was stopped, or that the machine was suspended, while the
        loop slept."""
        late_s = self._clock.monotonic() - max(self.wake_at, self._ran_at)
        if late_s > SUSPENDED_S:
            log.warning(pairs("suspended", bus=self.bus_name, for_s=f"{late_s:.1f}"))
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
        """Return the nodes in the order of their scans. Nodes that answer come first, in the YAML's
        order. The other nodes follow, the longest overdue first."""
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
        """Make every device due, because an input may have changed. Any thread may call this method."""
        self._edge = True
        self.inbox.wake()

    def _take_edge(self) -> None:
        """Make every device due if an edge has come. An edge that comes during this round takes effect
        in the next round."""
        if self._edge:
            self._edge = False
            self._due = dict.fromkeys(self._due, AGES_AGO)
