"""The next request takes the charge over."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import CHARGING, RightCharger


class ChargerIsTakenOver(RightCharger):
    def requested(self, request: d.ChargerRequest, now: float) -> None:
        super().requested(request, now)
        if self.shown.state == CHARGING:
            self.request = request
            self.shows(CHARGING, now)
