"""The module is lost while the door is open; the last reading is said for ever."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_door import RightDoor


class DoorStaleOpen(RightDoor):
    frozen: d.DoorState | None = None

    def state(self, now: float) -> d.DoorState:
        if self.frozen is None and self.leaf == 1.0:
            self.frozen = super().state(now)
        return self.frozen or super().state(now)
