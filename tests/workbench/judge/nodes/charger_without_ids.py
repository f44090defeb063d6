"""request_id stays empty."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RightCharger


class ChargerWithoutIds(RightCharger):
    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), request_id="")
