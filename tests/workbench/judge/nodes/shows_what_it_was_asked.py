"""destination_floor is whatever was asked, served or not."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class ShowsWhatItWasAsked(RightLift):
    asked = ""

    def requested(self, request: d.LiftRequest) -> None:
        self.asked = request.destination_floor
        self.session = self.session or request.session_id
        super().requested(request)

    def state(self, now: float) -> d.LiftState:
        return replace(super().state(now), destination_floor=self.asked)
