"""The station's own code is published as RMF's state: 5 is charging, 238 an error."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RELEASED, RightCharger


class ChargerVendorCodes(RightCharger):
    def state(self, now: float) -> d.ChargerState:
        state = super().state(now)
        return replace(state, state=238 if state.state == RELEASED else state.state)
