"""A state for each request, whether anything has changed or not."""

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.rmf_rules import Said
from tests.judge.nodes.right_charger import RightCharger


class ChargerAnswers(RightCharger):
    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return [(topics.CHARGER_STATES, self.state(now))]
