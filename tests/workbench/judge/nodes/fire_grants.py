"""Requests are obeyed during a fire (low_level_lift)."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class FireGrants(RightLift):
    def __init__(self) -> None:
        super().__init__()
        self.mode = 3

    def serves(self, request: d.LiftRequest) -> bool:
        return True
