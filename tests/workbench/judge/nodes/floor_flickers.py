"""The floor's code is sampled unfiltered: for a moment it is another floor."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class FloorFlickers(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        told = self._told
        wrong = told is not None and told.door_state == 2 and told.current_floor == "L1"
        return replace(state, current_floor="L2") if self.door == 1.0 and wrong else state
