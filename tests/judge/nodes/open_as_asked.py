"""OPEN because it was asked for; no sensor says so."""

from bridges.messages import definitions as d
from bridges.rmf_rules import Said
from tests.judge.nodes.right_door import RightDoor


class OpenAsAsked(RightDoor):
    def mode(self) -> int:
        return 2 if self.held else 0

    def hear(self, message: d.Message, now: float) -> list[Said]:
        super().hear(message, now)
        return self.tick(now) if self.mode() != self._told else []
