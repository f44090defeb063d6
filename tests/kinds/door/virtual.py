"""A door in virtual time: its core alone, or its core with driver, wires and a simulated door (the
plant).

The door is scanned as in the daemon's loop.
"""

from typing import Any

import msgspec

from bridges.kinds.door.core import decide, initial
from bridges.kinds.door.memory import DoorLimits, DoorMemory
from bridges.kinds.door.report import DoorReport
from bridges.kinds.door.settings import DoorDurations
from bridges.kinds.door.signals import CloseRequested, DoorOutputs, DoorSample, Event, OpenRequested
from bridges.kinds.shared.decision import Decision, IoFailed, Sampled, WriteFailed
from bridges.messages.definitions import DoorModeValue
from drivers import DriverError
from drivers.door.dry_contact import DryContactDoor, DryContactDoorSettings, create, debounce, wires
from hal_fakes.plants.door import build
from tests.drivers.far import PointsFar

SCAN_S = 0.125
DEBOUNCE_S = 0.0625
"""The debounce (s). It is a power of two, so sums of times stay exact and tests can compare with ==."""

CLOSED = DoorSample(opened=False, closed=True)
OPEN = DoorSample(opened=True, closed=False)
BETWEEN = DoorSample(opened=False, closed=False)
BOTH = DoorSample(opened=True, closed=True)

DEBOUNCED = dict.fromkeys(("opened", "closed", "obstruction", "fire"), DEBOUNCE_S)

STALE_S = DoorDurations().stale_after_s
OPENS, CLOSES = OpenRequested("door_supervisor"), CloseRequested("door_supervisor")

Decided = Decision[DoorMemory, DoorOutputs, DoorReport]


def limits(**durations: float) -> DoorLimits:
    return DoorLimits(t=DoorDurations(**durations), debounce=DEBOUNCED)


def word(mode: DoorModeValue) -> str:
    return mode.name.removeprefix("MODE_")


class CoreAlone:
    """The door's core alone, which gets its events from the test.

    `told` gets an entry (s, mode, relay on) whenever the mode or the relay changes. The relay holds the
    door open.
    """

    def __init__(self, limits: DoorLimits | None = None) -> None:
        self.limits = limits or DoorLimits(debounce=DEBOUNCED)
        self.now = 0.0
        self.memory = initial(self.limits, self.now)
        self.told: list[tuple[float, str, bool]] = []
        self.last: Decided | None = None

    def hears(self, event: Event) -> Decided:
        """Let the core decide on this event now."""
        decided = decide(self.memory, event, self.now, self.limits)
        self.memory, self.last = decided.memory, decided
        told = (word(decided.report.mode), decided.outputs.hold_open)
        if not self.told or self.told[-1][1:] != told:
            self.told.append((round(self.now, 4), *told))
        return decided

    def sees(self, sample: DoorSample | IoFailed, until: float) -> Decided:
        """Scan with these inputs from now until the time `until`."""
        event: Event = sample if isinstance(sample, IoFailed) else Sampled(sample)
        decided = self.hears(event)
        while self.now < until:
            self.now = min(until, self.now + SCAN_S, decided.wake_at)
            decided = self.hears(event)
        return decided

    def faults(self) -> tuple[str, ...]:
        """Return the present faults."""
        assert self.last is not None
        return tuple(str(fault) for fault in self.last.report.faults)


def settings(**changes: Any) -> DryContactDoorSettings:
    """Return the settings of a door on a Modbus module with these keys changed, as read from a YAML
    file."""
    inputs = changes.pop("inputs", {})
    plain = {
        "inputs": {
            "opened": _input(0, "high"),
            "closed": _input(1, "high"),
            **inputs,
        },
        "outputs": {"hold_open": {"point": "unit 1 coil 0", "active": "high"}},
        **changes,
    }
    plain["inputs"] = {key: value for key, value in plain["inputs"].items() if value}
    return msgspec.convert(plain, DryContactDoorSettings)


def _input(address: int, active: str) -> dict[str, Any]:
    point = f"unit 1 discrete input {address}"
    return {"point": point, "active": active, "debounce_s": DEBOUNCE_S}


OBSTRUCTION = _input(2, "low")
FIRE = _input(3, "low")


class Door:
    """The core, the driver, the wires and the simulated door.

    `told` has (s, mode) of each mode that RMF hears. `faults` gets an entry whenever the faults change.
    """

    def __init__(self, **changes: Any) -> None:
        self.settings = settings(**changes)
        self.limits = DoorLimits.of(self.settings, debounce(self.settings))
        self.plant = build("door", self.settings, wires(self.settings))
        self.bus = PointsFar(self, self.plant, wires(self.settings))
        self.now = 0.0
        self.told: list[tuple[float, str]] = []
        self.faults: list[tuple[float, tuple[str, ...]]] = []
        self.scans = 0
        self.restart()

    def restart(self) -> None:
        """Start a new daemon for the same door. The daemon's outputs are off, and it remembers
        nothing."""
        self.driver: DryContactDoor = create("door", self.settings, self.bus)
        self.memory = initial(self.limits, self.now)
        self.driver.open()
        self.scan()

    def run(self, until: float) -> None:
        """Scan from now until the time `until`."""
        while self.now < until:
            self.now = min(until, self.now + SCAN_S, self.wake_at)
            self.scan()

    def scan(self, *requests: Event) -> None:
        """Read the door, let the core decide, and write its outputs. The core gets the requests after
        the reading."""
        self.scans += 1
        decided = self._decide(self._read())
        for request in requests:
            decided = self._decide(request)
        try:
            self.driver.write(decided.outputs)
        except DriverError as error:
            decided = self._decide(WriteFailed(str(error)))
        self.wake_at = decided.wake_at
        self.report = decided.report
        _note(self.told, self.now, word(decided.report.mode))
        _note(self.faults, self.now, tuple(fault.code for fault in decided.report.faults))

    def opens(self, requester: str = "door_supervisor") -> None:
        """Let an OPEN request arrive."""
        self.scan(OpenRequested(requester))

    def closes(self, requester: str = "door_supervisor") -> None:
        """Let a CLOSE request arrive."""
        self.scan(CloseRequested(requester))

    @property
    def relay(self) -> list[tuple[float, bool]]:
        """Return (s, on) for every change of the relay that holds the door open."""
        return [
            (round(e.at, 4), bool(e.value)) for e in self.plant.edges if e.signal == "hold_open"
        ]

    def _read(self) -> Event:
        try:
            return Sampled(self.driver.read())
        except DriverError as error:
            return IoFailed(str(error))

    def _decide(self, event: Event) -> Decided:
        decided = decide(self.memory, event, self.now, self.limits)
        self.memory = decided.memory
        return decided


def _note(history: list[Any], now: float, what: Any) -> None:
    if not history or history[-1][1] != what:
        history.append((round(now, 4), what))
