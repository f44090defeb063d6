"""The controller is lost while the door is open; what was read last is said for ever."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class LiftStaleOpen(RightLift):
    read: d.LiftState | None = None

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        if self.read is None and self.door == 1.0:
            self.read = state
        last = self.read or state
        return replace(last, session_id=state.session_id, destination_floor=state.destination_floor)
