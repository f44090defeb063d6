"""OPEN with no floor: the floor's code is not read yet."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class OpenNowhere(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        first = self.door == 1.0 and self._told is not None and self._told.door_state != 2
        return replace(state, current_floor="") if first else state
