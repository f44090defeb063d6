"""A watchdog frees the lift after 5 s with an open door, without an END."""

from tests.workbench.judge.nodes.right_lift import LOOP_S, RightLift


class SessionTimesOut(RightLift):
    opened = 0

    def moves(self, age_s: float) -> None:
        super().moves(age_s)
        self.opened = self.opened + 1 if self.door == 1.0 else 0
        if self.opened * LOOP_S > 2.0:
            self.free()
