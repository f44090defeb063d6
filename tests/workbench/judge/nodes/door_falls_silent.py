"""When its module does not answer, no state comes."""

from tests.workbench.judge.nodes.right_door import RightDoor
from workbench.rmf_model import Said


class DoorFallsSilent(RightDoor):
    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [] if 10.0 < now - self.began_at < 18.0 else said
