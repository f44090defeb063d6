"""The fire alarm is told each second, as `false` while there is none (low_level_lift)."""

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.rmf_model import Said


class FireSaysFalse(RightLift):
    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [*said, (topics.FIRE_ALARM_TRIGGER, d.Bool(False))] if said else said
