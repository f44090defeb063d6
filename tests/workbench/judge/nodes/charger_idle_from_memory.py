"""The station is not reached any more, and IDLE is said for ever."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RightCharger


class ChargerIdleFromMemory(RightCharger):
    read_at = 0.0

    def state(self, now: float) -> d.ChargerState:
        self.read_at = self.read_at or now
        return super().state(self.read_at)
