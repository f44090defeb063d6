"""A state for each request, whether anything has changed or not."""

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_charger import RightCharger
from workbench.rmf_model import Said


class ChargerAnswers(RightCharger):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return [(topics.CHARGER_STATES, self.state(now))]
