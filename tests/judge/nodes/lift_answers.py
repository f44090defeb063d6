"""A state for each request, as most templates' callbacks publish it."""

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.rmf_rules import Said
from tests.judge.nodes.right_lift import RightLift


class LiftAnswers(RightLift):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        mine = isinstance(message, d.LiftRequest) and message.lift_name == self.name
        return [(topics.LIFT_STATES, self.state(now))] if mine else []
