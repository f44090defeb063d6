"""The state's mode has the request's numbers: AGV is 1 there, and HUMAN here."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class LiftModeMixed(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_mode={2: 1, 1: 2}[state.current_mode])
