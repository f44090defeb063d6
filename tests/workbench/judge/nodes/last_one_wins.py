"""Who asks last gets the lift, whoever is in the car."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class LastOneWins(RightLift):
    def requested(self, request: d.LiftRequest) -> None:
        self.free()
        super().requested(request)
