"""A state for each request."""

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_door import RightDoor
from workbench.rmf_model import Said


class DoorAnswers(RightDoor):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        mine = isinstance(message, d.DoorRequest) and message.door_name == self.name
        return [(topics.DOOR_STATES, self.state(now))] if mine else []
