"""The robot's name is what stood on the pad last."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RightCharger


class ChargerNamesAnotherRobot(RightCharger):
    def state(self, now: float) -> d.ChargerState:
        state = super().state(now)
        return replace(state, robot_name="yesterday's") if state.robot_name else state
