"""OPEN is a contact that is passed on the way."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class OpenWhileMoving(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, door_state=2) if state.motion_state else state
