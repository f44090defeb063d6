"""A state for each request, as most templates' callbacks publish it."""

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.rmf_model import Said


class LiftAnswers(RightLift):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        mine = isinstance(message, d.LiftRequest) and message.lift_name == self.name
        return [(topics.LIFT_STATES, self.state(now))] if mine else []
