"""The id of a cancel is not looked at."""

from tests.workbench.judge.nodes.right_charger import RightCharger


class AnyCancelCancels(RightCharger):
    def cancelled(self, request_id: str, now: float) -> None:
        super().cancelled(self.shown.request_id, now)
