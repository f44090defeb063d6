"""A door's node that keeps the contract, but differs from ours. For example, the door ends its hold
as soon as RMF sends CLOSE."""

from collections.abc import Sequence

from bridges.messages import definitions as d
from bridges.messages import topics
from bridges.messages.stamps import stamp
from workbench.rmf_model import Party, Said

LOOP_S = 0.25
TRAVEL_S = 2.0
DWELL_S = 3.0


class RightDoor(Party):
    """A correct door. `leaf` is 0 when the door is shut, and 1 when the door is open.

    People open the door at each time in `pushed_at` (s after the door's start). Then the door stays
    open for DWELL_S.
    """

    subscribes: Sequence[topics.AnyTopic] = (topics.DOOR_REQUESTS,)
    period_s = 1.0
    on_change = True
    name = "ward"

    def __init__(self, pushed_at: Sequence[float] = ()) -> None:
        self.leaf = 0.0
        self.held = False
        self.heard_at = 0.0
        self.pushed_at = pushed_at
        self.began_at = self.due_at = self.told_at = float("-inf")
        self._told = -1

    def hear(self, message: d.Message, now: float) -> list[Said]:
        if isinstance(message, d.DoorRequest) and message.door_name == self.name:
            self.heard_at = now
            self.asked(message.requested_mode.value)
        return []

    def asked(self, mode: int) -> None:
        if mode in (0, 2):
            self.held = mode == 2

    def tick(self, now: float) -> list[Said]:
        if self.began_at < 0:
            self.began_at = now
        self.due_at = now + LOOP_S
        self.moves(now, now - self.began_at)
        mode = self.mode()
        same = mode == self._told or not self.on_change
        if same and now < self.told_at + self.period_s:
            return []
        self._told, self.told_at = mode, now
        return [(topics.DOOR_STATES, self.state(now))]

    def wake_at(self) -> float:
        return self.due_at if self.due_at > 0 else 0.0

    def moves(self, now: float, age_s: float) -> None:
        opens = self.held or self.pushed(age_s)
        step = LOOP_S / TRAVEL_S
        self.leaf = min(1.0, self.leaf + step) if opens else max(0.0, self.leaf - step)

    def pushed(self, age_s: float) -> bool:
        return any(0.0 <= age_s - at < TRAVEL_S + DWELL_S for at in self.pushed_at)

    def mode(self) -> int:
        return 2 if self.leaf == 1.0 else 0 if self.leaf == 0.0 else 1

    def state(self, now: float) -> d.DoorState:
        return d.DoorState(stamp(now), self.name, d.DoorMode(self.mode()))
