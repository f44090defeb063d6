"""When its module does not answer, no state comes."""

from bridges.rmf_rules import Said
from tests.judge.nodes.right_door import RightDoor


class DoorFallsSilent(RightDoor):
    def tick(self, now: float) -> list[Said]:
        said = super().tick(now)
        return [] if 10.0 < now - self.began_at < 18.0 else said
