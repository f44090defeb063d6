"""One dispenser in virtual time: RMF's phase DispenseItem, the network, the daemon's node, its disk and
the machine.

The daemon is the product's own `Node`. It has its own memory on disk, and the driver for contacts. An
effect is the instant right before or right after a write to the disk, a message, or a switched output.
The daemon dies at the effect with the number `die_at`. Then its outputs go off. After DOWN_S a new
daemon starts with the same disk.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bridges.kinds.dispenser import KIND
from bridges.kinds.dispenser.settings import AskedFor, WorkcellDurations
from bridges.kinds.shared.decision import DecidedByPerson, OperatorReset, RequestRefused, RivalSeen
from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.runtime.clock import Clock
from bridges.runtime.device import AnyNode, Node
from bridges.runtime.device_memory import DeviceMemories
from drivers.dispenser.dry_contact import (
    DRIVER,
    DryContactWorkcellSettings,
    WorkcellInputWiring,
    WorkcellOutputWiring,
    wires,
)
from drivers.hal.points import Input, Output
from hal_fakes.plants.dispenser import WorkcellPlant, build
from tests.drivers.far import PointsFar
from workbench.rmf_model.workcells import WorkcellPhase

EPOCH = 2.0**30
SCAN_S = 0.0625
DOWN_S = 0.5
NAME = "store"
BOX = (d.DispenserRequestItem("box", 1),)

SETTINGS = DryContactWorkcellSettings(
    limits=WorkcellDurations(cycle_limit_s=8.0),
    items={"box": AskedFor(), "jar": AskedFor()},
    pulse_s=0.5,
    inputs=WorkcellInputWiring(
        done=Input("done", "high", "down", 0.0),
        busy=Input("busy", "high", "down", 0.0),
        ready=Input("ready", "high", "down", 0.0),
        fault=Input("fault", "low", "down", 0.0),
    ),
    outputs=WorkcellOutputWiring(
        start=Output("start", "high"),
        select={"box": Output("box", "high"), "jar": Output("jar", "high")},
    ),
)


class Killed(BaseException):
    """The death of the daemon's process."""


@dataclass
class Disk:
    """The daemon's file on disk, which outlives the daemon.

    `full` is the reason why writes fail, or "" if they succeed.
    """

    content: bytes | None = None
    full: str = ""
    around: Callable[[str], None] = lambda what: None

    def read(self) -> bytes | None:
        return self.content

    def write(self, kept: bytes) -> None:
        if self.full:
            raise OSError(self.full)
        self.around("before the disk")
        self.content = kept
        self.around("after the disk")


@dataclass
class World:
    """The daemon, RMF's phases, the disk and the machine.

    `lose(topic, number)` decides whether a message is lost. `said` has (s, message) of the daemon's
    messages.
    """

    settings: DryContactWorkcellSettings = SETTINGS
    die_at: int = -1
    lose: Callable[[str, int], bool] = lambda topic, number: False
    now: float = 0.0
    disk: Disk = field(default_factory=Disk)
    new: bool = True
    effects: list[str] = field(default_factory=list)
    said: list[tuple[float, d.Message]] = field(default_factory=list)
    phases: list[WorkcellPhase] = field(default_factory=list)
    deaths: int = 0
    daemon: AnyNode | None = None
    starts_at: float = 0.0
    inbox: dict[str, Any] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    waiting: list[tuple[float, d.Message]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.disk.around = self._effect
        self.table = wires(self.settings)
        self.plant: WorkcellPlant = build(NAME, self.settings, self.table)
        self.far = PointsFar(self, self.plant, self.table)

    # ---- actions of a story

    def ask(self, guid: str = "task", items: Any = BOX) -> WorkcellPhase:
        """Let RMF begin a phase DispenseItem with this request."""
        phase = WorkcellPhase(d.DispenserRequest(d.Time(), guid, NAME, "robot", items), self.now)
        self.phases.append(phase)
        return phase

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> "World":
        """Let time pass, until the condition `until` holds or for at most `seconds`."""
        end = self.now + seconds
        while self.now < end and not until():
            self.now += SCAN_S
            self._step()
        return self

    def decide(self, verdict: Any, request: str = "") -> None:
        """Let a person decide the outcome of a request in doubt."""
        self.inbox["person"] = DecidedByPerson(verdict, request)

    def reset(self) -> None:
        """Let an operator reset the dispenser."""
        self.inbox["reset"] = OperatorReset()

    def rival(self) -> None:
        """Let another node publish states of this dispenser."""
        self.inbox["rival"] = RivalSeen()

    def kill(self) -> None:
        """Kill the daemon. Its outputs go off, and a new daemon starts after DOWN_S."""
        self.daemon, self.deaths = None, self.deaths + 1
        self.inbox.clear()
        self.far.drive({w.point: w.level(False) for w in self.table if w.direction == "out"})
        self.starts_at = self.now + DOWN_S

    # ---- results for a story

    @property
    def state(self) -> d.DispenserState:
        """Return the daemon's last state."""
        return next(m for _, m in reversed(self.said) if isinstance(m, d.DispenserState))

    def results(self, guid: str = "task") -> list[str]:
        """Return the results for this request, without repeats."""
        found: list[str] = []
        for _, one in self.said:
            if isinstance(one, d.DispenserResult) and one.request_guid == guid:
                name = d.WorkcellStatus(one.status).name
                found += [name] if found[-1:] != [name] else []
        return found

    @property
    def faults(self) -> list[str]:
        """Return the codes of the present faults."""
        return [fault["code"] for fault in self.status.get("faults", [])]

    @property
    def status(self) -> Mapping[str, Any]:
        """Return the dispenser's part of the status file."""
        return self.daemon.status() if self.daemon else {}

    def relays(self, signal: str = "start") -> list[bool]:
        """Return the edges of a relay: True for on, False for off."""
        edges = self.plant.edges
        return [bool(e.value) for e in edges if e.what == "relay" and e.signal == signal]

    # ---- private functions

    def _effect(self, what: str) -> None:
        self.effects.append(what)
        if len(self.effects) - 1 == self.die_at:
            raise Killed(what)

    def _start(self) -> None:
        limits = KIND.limits(self.settings, {})
        driver = _Mortal(DRIVER.create(NAME, self.settings, self.far), self._effect)
        self.daemon = Node(
            NAME, KIND, self.settings, limits, driver, self._publish,
            Clock(lambda: self.now, lambda: EPOCH + self.now),
            memories=DeviceMemories(self.disk, new=self.new),
        )  # fmt: skip

    def _step(self) -> None:
        for phase in self.phases:
            if self.now >= phase.wake_at():
                for topic, message in phase.tick(self.now):
                    self._arrives(topic.name, message)
        self.plant.advance(self.now)
        try:
            if self.daemon is None and self.now >= self.starts_at:
                self._start()
            if self.daemon is not None:
                events, self.inbox = list(self.inbox.values()), {}
                self.daemon.scan(events)
        except Killed:
            self.kill()
        heard, self.waiting = self.waiting, []
        for _, message in heard:
            for phase in self.phases:
                phase.hear(message, self.now)

    def _arrives(self, topic: str, message: d.Message) -> None:
        """Put a request into the daemon's inbox, as the transport's thread does."""
        assert isinstance(message, d.DispenserRequest)
        if self.daemon is None or self._is_lost(topic):
            return
        try:
            event: Any = KIND.requests[topics.DISPENSER_REQUESTS](message, self.settings)
        except RequestRefused as refusal:
            self.daemon.refuse(message, refusal)
        else:
            self.inbox[f"request {event.guid}"] = event

    def _publish(self, topic: Any, message: d.Message) -> bool:
        self._effect(f"before {topic.name}")
        self.said.append((self.now, message))
        if not self._is_lost(topic.name):
            self.waiting.append((self.now, message))
        self._effect(f"after {topic.name}")
        return True

    def _is_lost(self, topic: str) -> bool:
        self.counts[topic] = number = self.counts.get(topic, -1) + 1
        return self.lose(topic, number)


class _Mortal:
    """A driver that counts effects. So the daemon may die right before or right after a switched
    output."""

    def __init__(self, driver: Any, around: Callable[[str], None]) -> None:
        self._driver = driver
        self._around = around
        self._last: object = None
        self.open, self.read = driver.open, driver.read
        self.make_safe, self.close = driver.make_safe, driver.close

    def write(self, outputs: Any) -> None:
        """Write the outputs. If they change, count one effect before the write and one effect after
        it."""
        changes, self._last = outputs != self._last, outputs
        if changes:
            self._around("before the outputs")
        self._driver.write(outputs)
        if changes:
            self._around("after the outputs")
