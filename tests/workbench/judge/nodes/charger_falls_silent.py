"""HTTP without a timeout in the callback: no state comes while the station is slow."""

from tests.workbench.judge.nodes.right_charger import ASSIGNED, RightCharger
from workbench.rmf_model import Said


class ChargerFallsSilent(RightCharger):
    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [] if self.shown.state == ASSIGNED and now - self.since < 8.0 else said
