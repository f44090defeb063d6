"""The door opens for the robot outside, in a fire as well."""

from tests.workbench.judge.nodes.right_lift import RightLift


class FireBoards(RightLift):
    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        if self.session and self.door < 1.0:
            self.mode = 3
            self.door = min(1.0, self.door + 0.5)
