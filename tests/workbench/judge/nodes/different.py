"""Correct nodes that differ from ours as far as the contract permits. The judge must accuse no node."""

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from tests.workbench.judge.nodes.right_charger import ERROR, RELEASED, RightCharger
from tests.workbench.judge.nodes.right_door import RightDoor
from tests.workbench.judge.nodes.right_lift import LOOP_S, RightLift
from workbench.rmf_model import Said


class SimulatedLift(RightLift):
    """The lift of RMF's simulation. The lift is always in AGV mode, lists no modes, shows the nearest
    floor, and keeps its last target."""

    modes = ()

    def moves(self, age_s: float) -> None:
        self.mode = 2
        super().moves(age_s)

    def state(self, now: float) -> d.LiftState:
        self.kept = self.target or getattr(self, "kept", "")
        return replace(super().state(now), current_mode=2, destination_floor=self.kept)


class SlowLift(RightLift):
    """The lift publishes every 2 s, as a lift at a field site does. The lift obeys an END up to 1 s
    later."""

    period_s = 2.0
    modes = (0, 1, 2, 3, 4, 5)
    end: d.LiftRequest | None = None

    def ended(self, end: d.LiftRequest) -> None:
        self.end = end

    def moves(self, age_s: float) -> None:
        if self.end is not None and int(age_s / LOOP_S) % 4 == 0:
            super().ended(self.end)
            self.end = None
        super().moves(age_s)


class EagerLift(RightLift):
    """The lift publishes ten times a second, even without a change."""

    beats_at = 0.0

    def tick(self, now: float) -> list[Said]:
        if now >= self.due_at:
            super().tick(now)
        self.beats_at = now + 0.1
        return [(topics.LIFT_STATES, self.state(now))]

    def wake_at(self) -> float:
        return self.beats_at


class LiftWithoutModes(RightLift):
    """The lift has a destination dispatch without an AGV mode. Mode and motion are UNKNOWN, and the
    list of floors is empty."""

    def state(self, now: float) -> d.LiftState:
        state = super().state(now)
        return replace(state, current_mode=0, motion_state=3, available_floors=())


class LiftInFire(RightLift):
    """A fire begins while the robot is in the car. The lift keeps the session, and opens at the recall
    floor."""

    fire = False

    def moves(self, age_s: float) -> None:
        if self.session and self.target == "L3":
            self.fire = True
        if self.fire:
            self.mode, self.target = 2, "L1" if self.session else ""
        super().moves(age_s)
        self.mode = 3 if self.fire else self.mode


class DoorOnChange(RightDoor):
    """The door publishes on change and every 2 s. The door takes half a second to open, and never shows
    MOVING."""

    period_s = 2.0

    def moves(self, now: float, age_s: float) -> None:
        for _ in range(4):
            super().moves(now, age_s)

    def mode(self) -> int:
        return 2 if self.leaf == 1.0 else 0


class LeasedDoor(RightDoor):
    """When its controller stops holding the door open, the door shows UNKNOWN for 1 s. From UNKNOWN,
    RMF sees that nobody holds the door any more."""

    def mode(self) -> int:
        return (
            4 if self.began_at > 0 and 5.0 < self.due_at - self.began_at < 6.0 else super().mode()
        )


class ChargerInError(RightCharger):
    """After each release the charger shows ERROR with a reason, and keeps the request's id."""

    def goes_on(self, now: float) -> None:
        if self.shown.state == RELEASED:
            self.shows(ERROR, now, "station: over temperature")
        super().goes_on(now)
