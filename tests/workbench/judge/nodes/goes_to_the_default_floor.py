"""A floor that it does not serve is taken for the first one."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class GoesToTheDefaultFloor(RightLift):
    def requested(self, request: d.LiftRequest) -> None:
        known = request.destination_floor in self.floors
        floor = request.destination_floor if known else self.floors[0]
        super().requested(replace(request, destination_floor=floor))
