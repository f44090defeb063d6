"""The request's numbers typed anew: END 1, AGV 2, HUMAN 3 (QuikSync). AGV ends, and END is nothing."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift
from workbench.rmf_model import Said


class LiftNumbersMixed(RightLift):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest) and message.lift_name == self.name:
            if message.request_type == 1:
                self.ended(message)
            elif message.request_type == 2:
                self.requested(message)
        return []
