"""The contact of the open door is not debounced."""

from tests.workbench.judge.nodes.right_door import LOOP_S, RightDoor


class DoorFlaps(RightDoor):
    def mode(self) -> int:
        return 1 if self.leaf == 1.0 and int(self.due_at / LOOP_S) % 3 == 0 else super().mode()
