"""start_timeout is not looked at."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_charger import RightCharger


class ChargerWaitsForEver(RightCharger):
    def requested(self, request: d.ChargerRequest, now: float) -> None:
        super().requested(replace(request, start_timeout=d.Duration()), now)
