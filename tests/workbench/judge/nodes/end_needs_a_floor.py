"""END_SESSION is refused when its floor is not served, as "" never is (lift_adapter_template)."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class EndNeedsAFloor(RightLift):
    def ended(self, end: d.LiftRequest) -> None:
        if end.destination_floor in self.floors:
            super().ended(end)
