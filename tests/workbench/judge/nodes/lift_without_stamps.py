"""lift_time is never filled."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class LiftWithoutStamps(RightLift):
    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), lift_time=d.Time())
