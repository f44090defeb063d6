"""No request for 10 s closes the door (lci-rmf-adapter)."""

from tests.workbench.judge.nodes.right_door import RightDoor


class SilenceCloses(RightDoor):
    on_change = False

    def moves(self, now: float, age_s: float) -> None:
        self.held = self.held and now - self.heard_at < 10.0
        super().moves(now, age_s)
