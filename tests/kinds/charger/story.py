"""Stories for the charger's core in virtual time. The core reads the station once a second."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from msgspec.structs import replace

from bridges.kinds.charger import core
from bridges.kinds.charger.memory import ChargerLimits, ChargerMemory
from bridges.kinds.charger.report import ChargerReport
from bridges.kinds.charger.settings import ChargerDurations, robot
from bridges.kinds.charger.signals import (
    Activity,
    Cancelled,
    ChargeRequested,
    ChargerOutputs,
    ChargerSample,
    Event,
    Measured,
)
from bridges.kinds.shared.decision import IoFailed, OperatorReset, RivalSeen, Sampled

DURATIONS = ChargerDurations(misses=3, start_timeout_s=60.0, released_s=2.0)
LIMITS = ChargerLimits(DURATIONS, can_stop=False)
"""The limits of a station that the core can only observe."""
RECEIVERS = {"rx-1": robot("tiny/AMR01"), "rx-2": robot("tiny/AMR02")}


FULL = ChargerLimits(DURATIONS, RECEIVERS)
"""The limits of a station that recognises the robot on its pad and that the core can stop."""


def observed(**durations: Any) -> ChargerLimits:
    """Return the limits of a station that the core can only observe, with these durations changed."""
    return ChargerLimits(ChargerDurations(**durations), can_stop=False)


A = Activity
IDLE = Sampled(ChargerSample(A.IDLE, 0))
HANDSHAKE = Sampled(ChargerSample(A.HANDSHAKE, 1))
CHARGING = Sampled(ChargerSample(A.CHARGING, 5))
STOPPING = Sampled(ChargerSample(A.STOPPING, 11))
RELEASED = Sampled(ChargerSample(A.RELEASED, 7))
HOT = Sampled(ChargerSample(A.ERROR, 238, "over temperature"))
ODD = Sampled(ChargerSample(A.UNKNOWN, 99))
SILENT = IoFailed("192.168.1.60:80 refuses the connection")
RIVAL = RivalSeen()
RESET = OperatorReset()
SCANS: dict[str, Event] = {
    "idle": IDLE,
    "handshake": HANDSHAKE,
    "charging": CHARGING,
    "stopping": STOPPING,
    "released": RELEASED,
    "hot": HOT,
    "odd": ODD,
    "silent": SILENT,
}

AMR1 = ChargeRequested("req-1", "tiny", "AMR01")
AMR2 = ChargeRequested("req-2", "tiny", "AMR02")
CANCEL_1 = Cancelled("req-1")


@dataclass
class Story:
    """The charger's core with its memory, in virtual time.

    `told` gets an entry (s, state, request id or error) at each change. `powered` gets the core's order
    for the power after each reading by `sees`. `wakes` is the time (s) for which the core asked last.
    """

    limits: ChargerLimits = LIMITS
    now: float = 0.0
    memory: ChargerMemory = field(default_factory=lambda: core.initial(LIMITS, 0.0))
    told: list[tuple[float, str, str]] = field(default_factory=list)
    refused: list[tuple[float, str]] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    report: ChargerReport | None = None
    outputs: ChargerOutputs = field(default_factory=ChargerOutputs)
    powered: list[bool | None] = field(default_factory=list)
    wakes: float = 0.0

    def event(self, event: Event) -> "Story":
        """Let the core decide on an event now."""
        decision = core.decide(self.memory, event, self.now, self.limits)
        self.memory, self.outputs, self.report = decision.memory, decision.outputs, decision.report
        self.wakes, shown = decision.wake_at, decision.report
        state = shown.state.name.removeprefix("CHARGER_")
        line = (state, shown.error_message or shown.request_id)
        if not self.told or self.told[-1][1:] != line:
            self.told.append((self.now, *line))
        if decision.refused:
            self.refused.append((self.now, decision.refused))
        for fault in shown.faults:
            if str(fault) not in self.faults:
                self.faults.append(str(fault))
        return self

    def polls(self, script: str) -> "Story":
        """Read the station once a second. `idle 3, charging 2` means three readings of idle, then two
        readings of charging."""
        for part in script.split(","):
            word, count = part.split()
            for _ in range(int(count)):
                self.event(SCANS[word])
                self.now += 1.0
        return self

    def sees(self, *readings: tuple[Activity, str, int], **known: Any) -> "Story":
        """Read a station that recognises the robot on its pad, once a second.

        Each item of `readings` is `(activity, receiver, number of readings)`.
        """
        for activity, receiver, count in readings:
            sample = ChargerSample(activity, 0, measured=Measured(receiver_id=receiver, **known))
            for _ in range(count):
                self.event(Sampled(sample))
                self.powered.append(self.outputs.power)
                self.now += 1.0
        return self

    def all(self, events: Iterable[Event]) -> "Story":
        """Let several events happen at once."""
        for event in events:
            self.event(event)
        return self


def measured(sample: ChargerSample, **known: float) -> Sampled[ChargerSample]:
    """Return a reading with these measured values."""
    return Sampled(replace(sample, measured=Measured(**known)))  # type: ignore[arg-type]
