"""The operator's status word as it came: 5 is locked."""

from tests.workbench.judge.nodes.right_door import RightDoor


class DoorVendorCodes(RightDoor):
    def mode(self) -> int:
        return 5 if self.leaf == 0.0 else super().mode()
