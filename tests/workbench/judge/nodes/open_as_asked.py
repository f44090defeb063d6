"""OPEN because it was asked for; no sensor says so."""

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_door import RightDoor
from workbench.rmf_model import Said


class OpenAsAsked(RightDoor):
    def mode(self) -> int:
        return 2 if self.held else 0

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return self.tick(now) if self.mode() != self._told else []
