"""The floor's number is its name's last character: L10 is the floor below L1."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from tests.workbench.judge.nodes.right_lift import RightLift


class FloorByLastCharacter(RightLift):
    floors = ("L9", "L10", "L11")

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_floor=f"L{state.current_floor[-1]}")
