"""In a fire the session is cleared, though only END frees the supervisor's slot."""

from tests.workbench.judge.nodes.right_lift import RightLift


class FireFrees(RightLift):
    def moves(self, age_s: float) -> None:
        if self.mode == 2 and self.door == 1.0:
            self.mode = 3
            self.free()
        super().moves(age_s)
