"""CLOSE starts the motor: the door shuts on the people who have opened it."""

from tests.workbench.judge.nodes.right_door import RightDoor


class CloseDrivesShut(RightDoor):
    shut = False

    def asked(self, mode: int) -> None:
        super().asked(mode)
        self.shut = mode == 0

    def pushed(self, age_s: float) -> bool:
        pushed = super().pushed(age_s)
        self.shut = self.shut and pushed
        return pushed and not self.shut
