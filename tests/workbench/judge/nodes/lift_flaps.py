"""The door's contact is not debounced: OPEN flickers while the robot drives in."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import LOOP_S, RightLift


class LiftFlaps(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        flickers = int(now / LOOP_S) % 3 == 0
        return replace(state, door_state=1) if self.door == 1.0 and flickers else state
