"""The fire alarm is told once, and volatile: no fleet adapter hears it (low_level_lift)."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.rmf_model import Said

ALARM = replace(topics.FIRE_ALARM_TRIGGER, publish=topics.VOLATILE)


class FireIsVolatile(RightLift):
    told = False

    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        if self.told:
            return said
        self.told = True
        return [*said, (ALARM, d.Bool(True))]
