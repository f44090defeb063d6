"""The door's status word of the vendor, as it came: 3 is locked."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class LiftVendorCodes(RightLift):
    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, door_state=3) if state.door_state == 0 else state
