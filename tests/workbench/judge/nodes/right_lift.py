"""A lift's node that keeps the contract, but differs from ours. For example, the node's loop takes 0.25
s."""

from collections.abc import Sequence

from msgspec.structs import replace

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from workbench.rmf_model import Party, Said

LOOP_S = 0.25
DOOR_S = 1.0


class RightLift(Party):
    """A correct lift. It publishes every `period_s`, and at each change.

    `car` is the car's floor, counted from 0 at the bottom. `door` is 0 when shut, and 1 when open.
    """

    subscribes: Sequence[topics.AnyTopic] = (topics.LIFT_REQUESTS,)
    period_s = 1.0
    floor_s = 2.0
    name = "Lift1"
    floors: tuple[str, ...] = ("L1", "L2", "L3")
    modes: tuple[int, ...] = (1, 2)

    def __init__(self) -> None:
        self.car, self.door = 0.0, 0.0
        self.session = self.target = ""
        self.mode = 1
        self.began_at = self.due_at = self.told_at = float("-inf")
        self._told: d.LiftState | None = None

    # ---- requests

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.LiftRequest) and message.lift_name == self.name:
            if message.request_type == 0:
                self.ended(message)
            else:
                self.requested(message)
        return []

    def ended(self, end: d.LiftRequest) -> None:
        if end.session_id == self.session:
            self.free()

    def requested(self, request: d.LiftRequest) -> None:
        if self.session in ("", request.session_id) and self.serves(request):
            self.session, self.target = request.session_id, request.destination_floor

    def serves(self, request: d.LiftRequest) -> bool:
        hazard = self.mode in (3, 4, 5) and request.session_id != self.session
        return request.destination_floor in self.floors and not hazard

    def free(self) -> None:
        self.session = self.target = ""

    # ---- movement

    def tick(self, now: float) -> list[Said]:
        if self.began_at < 0:
            self.began_at = now
        self.due_at = now + LOOP_S
        self.moves(now - self.began_at)
        state = self.state(now)
        changed = self._told is None or replace(state, lift_time=self._told.lift_time) != self._told
        if not changed and now < self.told_at + self.period_s:
            return []
        self._told, self.told_at = state, now
        return [(topics.LIFT_STATES, state)]

    def wake_at(self) -> float:
        return self.due_at if self.due_at > 0 else 0.0

    def moves(self, age_s: float) -> None:
        """Move car and door for 0.25 s. The mode follows the session."""
        if self.mode in (1, 2):
            self.mode = 2 if self.session else 1
        goal = float(self.floors.index(self.target)) if self.target else self.car
        if self.target and goal == self.car and self.mode == 2:
            self.door = min(1.0, self.door + LOOP_S / DOOR_S)
        else:
            self.door = max(0.0, self.door - LOOP_S / DOOR_S)
        if self.door == 0.0 and goal != self.car and self.mode == 2:
            step = LOOP_S / self.floor_s
            self.car += step if goal > self.car else -step

    def state(self, now: float) -> d.LiftState:
        moving = self.car != int(self.car)
        door = 2 if self.door == 1.0 else 0 if self.door == 0.0 else 1
        return d.LiftState(
            lift_time=stamp(now),
            lift_name=self.name,
            available_floors=self.floors,
            current_floor=self.floors[round(self.car)],
            destination_floor=self.target,
            door_state=door,
            motion_state=(1 if self.going_up else 2) if moving else 0,
            available_modes=self.modes,
            current_mode=self.mode,
            session_id=self.session,
        )

    @property
    def going_up(self) -> bool:
        return bool(self.target) and self.floors.index(self.target) > self.car
