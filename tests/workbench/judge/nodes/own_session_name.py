"""session_id is the vendor's booking number, not the requester's."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class OwnSessionName(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, session_id="booking-4711") if state.session_id else state
