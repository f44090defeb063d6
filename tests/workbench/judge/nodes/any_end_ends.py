"""END_SESSION of anybody releases the lift (low_level_lift)."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class AnyEndEnds(RightLift):
    def ended(self, end: d.LiftRequest) -> None:
        self.free()
