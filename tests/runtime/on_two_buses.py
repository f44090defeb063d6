"""One device whose inputs are on two buses, such as a door. The daemon's own service runs in virtual
time.

The device itself is on the bus `gateway`. Some of its inputs, such as a fire contact, are on the bus
`header`. On a bus that is down every call fails at once. A hanging bus runs no round, because its
thread waits for an answer.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

from bridges import __version__
from bridges.blackbox.entries import Head
from bridges.blackbox.ring import Ring
from bridges.kinds import kind_called
from bridges.kinds.shared.kind import Kind
from bridges.kinds.shared.recording_section import RecordingSettings
from bridges.messages.releases import NEWEST
from bridges.runtime.clock import Clock
from bridges.runtime.loop import Loop
from bridges.runtime.ring_writer import NOBODY, RingWriter
from bridges.runtime.service import Devices, named_by
from bridges.settings.load import load
from drivers.hal import Bus
from hal_fakes.fake import plants_on
from tests.drivers.far import PointsFar
from tests.transports.memory import MemoryNetwork, MemoryTransport

DOOR: Final = """
kind: door
driver: dry_contact
buses:
  gateway: {type: modbus, tcp: {host: 127.0.0.1}, scan_s: 0.1, without_watchdog: {1: a test}}
  header: {type: gpio, scan_s: 0.05}
doors:
  D:
    bus: gateway
    on_fire: release
    limits: {stale_after_s: 1.0, hazard_clear_s: 0.5, close_grace_s: 0}
    inputs:
      opened: {point: "unit 1 discrete input 0", active: high}
      closed: {point: "unit 1 discrete input 1", active: high}
      fire: {bus: header, point: BCM4, active: low, pull: down}
    outputs:
      hold_open: {point: "unit 1 coil 0", active: high}
"""


class FarBus(PointsFar, Bus):
    """A stand-in for one bus with the equipment behind it. `read_at` is the time of the last successful
    reading (s). `shown` has the levels of that reading."""

    def __init__(self, clock: Any, plant: Any, wires: Any) -> None:
        super().__init__(clock, plant, wires)
        self.read_at = float("-inf")
        self.shown: Mapping[str, bool] = {}
        self.wake: Callable[[], None] = lambda: None
        self._far_clock = clock

    def on_edge(self, wake: Callable[[], None]) -> None:
        self.wake = wake

    def levels(self) -> dict[str, bool]:
        self.shown = super().levels()
        self.read_at = self._far_clock.now
        return dict(self.shown)


class OnTwoBuses:
    """The daemon's service for one device. `states` lists the published states as (time in s, message).
    After each round of a bus the service calls `after_round(bus)`."""

    def __init__(self, file: Path, ring: Path | None = None) -> None:
        """Start the service. The service records into the ring buffer in the folder `ring`. If `ring`
        is None, the service records nothing."""
        self.now = 0.0
        self.config = load(file)
        (self.device,) = self.config.devices
        self.hanging: set[str] = set()
        self.states: list[tuple[float, Any]] = []
        self.after_round: Callable[[str], None] = lambda bus: None
        (self.plant,) = plants_on(self.config, "gateway").values()
        self.far = {
            bus: FarBus(self, self.plant, self.config.wires_on(bus, self.device))
            for bus in self.config.buses
        }
        network = MemoryNetwork()
        self.rmf = MemoryTransport(network, "rmf")
        kind = kind_called(self.config.kind)
        assert isinstance(kind, Kind)
        assert kind.states
        self.rmf.subscribe(kind.states, lambda state: self.states.append((self.now, state)))
        clock = Clock(lambda: self.now, lambda: 1e6 + self.now)
        self.served = Devices(
            self.config,
            kind,
            MemoryTransport(network, "bridge"),
            self.far.__getitem__,
            lambda topic: named_by(self.config, topic),
            clock,
            writer=self._recorded(ring, clock) if ring else NOBODY,
        )
        self.served.subscribe()
        self.loops: dict[str, Loop] = dict(zip(self.config.buses, self.served._loops, strict=True))

    def _recorded(self, folder: Path, clock: Clock) -> RingWriter:
        file, config = str(self.config.path), self.config
        about = RecordingSettings()
        head = Head("r", 1, __version__, config.kind, file, config.text, {}, True, {}, about)
        return RingWriter(partial(Ring, folder, head, 4_000_000), clock, lambda: NEWEST)

    def run(self, for_s: float) -> None:
        """Run the rounds of both threads for this time, in the order of their due times."""
        until = self.now + for_s
        while (due := self._due()) and due[0] <= until:
            self.now = max(self.now, due[0])
            self.loops[due[1]].round()
            self.after_round(due[1])
        self.now = until

    def _due(self) -> tuple[float, str] | None:
        running = [bus for bus in self.loops if bus not in self.hanging]
        woken = [(self.now, bus) for bus in running if self.loops[bus].inbox.wait(0.0)]
        due = [(self.loops[bus].wake_at, bus) for bus in running]
        return min((*woken, *due), default=None)

    def relays(self) -> list[str]:
        """Return the relays that are on."""
        levels = self.far["gateway"]._levels
        wires = self.config.wires_on("gateway", self.device)
        return [w.signal for w in wires if w.direction == "out" and levels.get(w.point)]

    def press(self, signal: str, on: bool) -> None:
        self.plant.press(signal, on, self.now)
