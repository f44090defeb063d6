"""error_message has the status line of the station in every state."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RightCharger


class ChargerTalksAlways(RightCharger):
    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), error_message="48.1 V 0.0 A")
