"""door_time is never filled."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_door import RightDoor


class DoorWithoutStamps(RightDoor):
    def state(self, now: float) -> d.DoorState:
        return replace(super().state(now), door_time=d.Time())
