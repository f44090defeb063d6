"""The lift's core without driver and network. Tests give events to the core at chosen times."""

from typing import Any

from msgspec.structs import replace

from bridges.kinds.lift.core import decide
from bridges.kinds.lift.memory import LiftLimits, LiftMemory
from bridges.kinds.lift.settings import Floor, LiftDurations, LiftSettings
from bridges.kinds.lift.signals import (
    DoorReading,
    Hazard,
    LiftRequested,
    LiftSample,
    Motion,
    Side,
)
from bridges.kinds.shared.decision import (
    Fault,
    Sampled,
)

DEBOUNCE = {"floor": 0.08, "door": 0.03, "rear_door": 0.04, "agv_mode": 0.05, Hazard.FIRE: 0.06}


AT_L1 = LiftSample("L1", DoorReading.OPEN, motion=Motion.STOPPED, agv=True)


CLOSED = replace(AT_L1, door=DoorReading.CLOSED)


ASKED = LiftRequested("A", True, "L1")


class Alone:
    """The lift's core without a driver. The test gives events to the core. `decision` is the last
    decision."""

    def __init__(
        self, debounce: dict[str, float] | None = None, by_call: bool = False, **limits: Any
    ) -> None:
        floors = {"L1": Floor(), "L2": Floor(side=Side.REAR), "L3": Floor()}
        settings = LiftSettings(
            floors=floors,
            limits=LiftDurations(**limits),
            fire_reset="manual",
            agv_mode="by_call" if by_call else "requested",
        )
        self.limits = LiftLimits.of(settings, debounce or {})
        self.memory = LiftMemory()

    def __call__(self, now: float, *events: Any) -> "Alone":
        for event in events:
            event = Sampled(event) if isinstance(event, LiftSample) else event
            self.decision = decide(self.memory, event, now, self.limits)
            self.memory = self.decision.memory
        return self

    @property
    def faults(self) -> tuple[Fault, ...]:
        return self.decision.report.faults
