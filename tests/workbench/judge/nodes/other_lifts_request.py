"""The name is looked at when it is too late (sharp-rmf/low_level_lift)."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.rmf_model import Said


class OtherLiftsRequest(RightLift):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest):
            super().hear(replace(message, lift_name=self.name), now)
        return []
