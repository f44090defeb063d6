"""A cancel counts only while it charges."""

from tests.workbench.judge.nodes.right_charger import CHARGING, RightCharger


class ChargerIgnoresCancels(RightCharger):
    def cancelled(self, request_id: str, now: float) -> None:
        if self.shown.state == CHARGING:
            super().cancelled(request_id, now)
