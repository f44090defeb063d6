"""The callback waits for the car: no state comes meanwhile (low_level_lift, up to 60 s)."""

from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.rmf_model import Said


class LiftBlocks(RightLift):
    floor_s = 4.0

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        rides = bool(self.target) and self.floors.index(self.target) != self.car
        return [] if rides else said
