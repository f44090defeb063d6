"""charger_time is never filled."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RightCharger


class ChargerWithoutStamps(RightCharger):
    def state(self, now: float) -> d.ChargerState:
        return replace(super().state(now), charger_time=d.Time())
